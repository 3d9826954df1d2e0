"""From a measured rubber to a material: tables of moduli, time-temperature shift, Prony series, material files."""
