"""Figures of studies: each module has `show`, from the records of groups to sections of a page."""
