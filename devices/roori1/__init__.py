"""ROORI1: a base struck by a projectile slides into a stopper."""
