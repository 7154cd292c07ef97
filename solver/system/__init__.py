"""The machine: errors, files, HDF5, time, memory, processes, provenance."""
