//! Benchmarks of the workspace: `cargo bench -p furuta-benches`.
