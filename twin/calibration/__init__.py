"""What a specimen is, from what it did."""
