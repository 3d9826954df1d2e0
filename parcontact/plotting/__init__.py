"""Pictures of runs, friction curves, surfaces, sweeps and studies."""
