"""A case and its mesh as arrays: groups, attributes, rigid bodies, gap operators."""
