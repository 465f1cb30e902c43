"""What a whole run asks of table and block: positioning, pulse, brake, return, and stopping at any moment of it."""
