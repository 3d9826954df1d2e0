"""Sentences of the warnings about heat (`doubts.Doubt`)."""

SENTENCES = {
    "decomposes": (
        "flash temperatures of {count} of {points} points are above {most:g} K, up to {rise:.3g} K at {speed:g} m/s: "
        "rubber decomposes there; take a smaller thermal.distance, velocity or pressure"
    ),
    "flash temperatures": (
        "with its flash temperature the rubber is beyond the {low:g} to {high:g} C of its measurement at {count} of "
        "{points} points, up to {hottest:.3g} C at {speed:g} m/s: the shift is an extrapolation there"
    ),
}
