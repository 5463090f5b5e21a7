"""The board: how well time steppers hold the free motion of closed loops."""
