"""Files of results: HDF5, csv, logs, copies of jobs, directories and their locks."""
