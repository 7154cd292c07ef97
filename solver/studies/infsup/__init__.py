"""The inf-sup test of the contact pressure."""
