"""Files of results: what each holds, and which of it is what."""
