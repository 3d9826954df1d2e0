"""Who owns which rows, and how data moves between ranks. MPI lives here (files excepted)."""
