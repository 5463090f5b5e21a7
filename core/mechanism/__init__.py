"""Mechanism: the description of bodies, joints, drivers and motions. It computes nothing."""
