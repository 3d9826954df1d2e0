"""Every file that a program writes, reads or shares with others: HDF5, csv, log, job copies, directories."""
