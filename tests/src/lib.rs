//! Tests across the crates of the workspace; see the files beside this folder.
