"""The physics of the contact. Modules here do not call MPI: collective functions communicate by the slab and the
transform."""
