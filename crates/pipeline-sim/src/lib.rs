//! pipeline-sim
