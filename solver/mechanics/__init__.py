"""Arrays only: finite elements, mortar contact, linear solvers. Knows no case, file or report."""
