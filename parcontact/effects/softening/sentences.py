"""Sentences of the warnings about softening (`doubts.Doubt`)."""

SENTENCES = {
    "strains beyond the sweep": (
        "the strain is {strain:.2g} at {speed:g} m/s, beyond the {low:.3g} to {high:.3g} of the sweep at {count} of "
        "{points} points: factors of its ends are used there; measure a wider range of strains"
    )
}
