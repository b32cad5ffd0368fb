//! Annotated sequences, error measures, plots.
