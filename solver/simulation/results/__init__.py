"""The solution: fields, forces, probes, balance, exact values."""
