"""Distribution of rows over ranks, and communication between ranks. Only this room, and files, use MPI."""
