"""Digital outputs and inputs (CiA 401): what releases or fires a machine, and says what it is in."""
