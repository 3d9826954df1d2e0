"""Adhesion: surfaces that attract each other.

Columns of adhesion.

Sentences of the warnings about adhesion (`doubts.Doubt`).
"""

from ...column import Column, Table

SECTION, EFFECT = "adhesion", "AdhesionColumns"
CHANGES_STEPS = ("adhesion.work", "adhesion.range", "adhesion.law")  # see `capabilities`


MEASURES: Table = (
    Column(
        *("tensile_area", ""),
        "share of all points with a tension above 1 % of the largest attraction (with `adhesion`)",
        when="adhesion",
    ),
    Column("adhesive_force", "N", "sum of all tension (with `adhesion`)", when="adhesion"),
    Column(
        *("surface_energy", "J"),
        "energy of adhesion: 0 for separated surfaces, negative for attracting ones (with `adhesion` and "
        "`output.energy`)",
        when="adhesion",
    ),
    Column(
        *("snap_loss", "J"),
        "energy lost in snaps since the start (with `adhesion` and `output.energy`)",
        when="adhesion",
    ),
)
RESULTS: Table = (  # results of a sweep
    Column(
        *("pull_off", "N"),
        "with adhesion: force of the last pull-off; empty if contact is never lost ({doc}`adhesion`)",
        when="adhesion",
    ),
    Column(*("pull_off_error", "N"), "error of `pull_off` by steps, solves and mesh", when="adhesion"),
    Column("pull_off_approach", "m", "approach at the last pull-off", when="adhesion"),
)


SENTENCES = {
    "work": (
        "adhesion.work is {work:g} J/m^2 and the range {range:.3g} m: dry surfaces have a work of adhesion of at most "
        "{most:g} J/m^2, rubber about 0.05; the material adds what the body dissipates"
    ),
    "strained edges": (
        "strains at the edges of contact are about work/(E* range) = {strain:.2g}; the theory assumes small strains, "
        "up to {most:g}. adhesion.work is {work:g} J/m^2 and the range {range:.3g} m; use a longer range or a smaller "
        "work"
    ),
    "long range": (
        "adhesion.work is {work:g} J/m^2 and the range {range:.3g} m, more than {most:g} of the box: points then also "
        "attract points that are not opposite, which the law neglects; use {remedy}"
    ),
    "coarse tip": (
        "a cell, {cell:.3g} m, is {ratio:.2g} times sqrt(radius range), the radius within which {sphere} is attracted; "
        "at {most:g} times the sum over points is wrong by 3 %; use cells of {fine!d} m, or a range of {enough!u} m"
    ),
    "small sphere": (
        "it attracts out to sqrt(2 radius range), more than its radius, {radius:g} m; the theory assumes small slopes: "
        "use an adhesion.range of at most {most!d} m"
    ),
    "cut attraction": (
        "{share!p} of its attraction over an adhesion.range of {range:.3g} m comes from beyond {room:.3g} m, where "
        "the box ends (limit: {most!p}); use a range of at most {shorter!d} m, or {more!u} m of room around the "
        "sphere"
    ),
    "attraction at an edge": (
        "{share!p} of its attraction over an adhesion.range of {range:.3g} m comes from beyond {room:.3g} m, where "
        "the box ends (limit: {most!p}); use {more!u} m of room around the sphere"
    ),
    "coarse process zone": (
        "a cell, {cell:.3g} m, is {ratio:.2g} times as long as the process zone, so the forces at edges of contact are "
        "not resolved: pull-off is wrong by 4 % at 1.2 times and by 23 % at 1.8 times; use a range of {enough!u} m "
        "or more, or cells of {zone!d} m"
    ),
    "range beyond heights": (
        "the range, {range:.3g} m, is more than the {span:.3g} m from the lowest to the highest point of the surface, "
        "so the attraction is nearly uniform and adhesion acts as a pressure of work/range; use {remedy}"
    ),
    "range follows cells": (
        "auto depends on cells, work and modulus, and gives {least:.4g} to {most:.4g} m in these cases, which are "
        "different physics; to compare them give all one range: {most:.4g} m is resolved by the cells of each"
    ),
}
