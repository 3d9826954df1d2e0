"""Closed forms and other references of high accuracy, for tests and for users.

They are plain functions of numbers and numpy arrays, independent of the simulation. Everything is in SI units. A
viscoelastic body is incompressible and given by its shear relaxation function as a Prony series

    G(t) = modulus_inf + sum_j moduli[j] exp(-t / relaxation_times[j]),

always as three arguments `modulus_inf, moduli, relaxation_times` in a row, so that a `physics.prony.Prony` can be
passed as `*material`. A body with a constant Poisson ratio nu instead of 1/2 has the pressures and displacements of an
incompressible body whose moduli are all multiplied by 1/(2 (1 - nu)).
"""
