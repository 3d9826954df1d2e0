"""Measured rubbers as materials: tables of moduli, time-temperature shift, Prony series, material files."""
