"""Forces: inverse dynamics, reactions of joints and efforts of drivers."""
