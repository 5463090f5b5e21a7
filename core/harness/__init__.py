"""The harness: cases, the engine protocol, running, comparing and reporting. It knows no simulator."""
