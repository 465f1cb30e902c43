"""What will happen next: the state that follows the specimen, and the futures that start from it."""
