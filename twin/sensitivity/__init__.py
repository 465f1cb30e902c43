"""How much of a prediction hangs on the model, on the first tilt and on the slenderness (Ceh 2018, 3.4, 3.5, 8.3.4)."""
