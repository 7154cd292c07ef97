"""The page of error against run time: which treatment for which accuracy, at what cost."""
