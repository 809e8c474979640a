//! A program in C or C++, compiled and asked.

use std::io::Write as _;
use std::process::{Command, Stdio};

/// What the program of one source file prints for this input; `None` where there is no such compiler.
pub(crate) fn answer(
    compiler: &str,
    options: &[&str],
    source: &str,
    input: &str,
) -> Option<String> {
    // Tests of one program run side by side, each with a folder of its own.
    let test = std::thread::current();
    let test = test.name().unwrap_or_default().replace(':', "-");
    let folder = format!("furuta-compiled-{}-{test}", std::process::id());
    let folder = std::env::temp_dir().join(folder);
    std::fs::create_dir_all(&folder).expect("a folder for the program");
    let program = folder.join("program");
    let compiled = Command::new(compiler)
        .args(["-Wall", "-Wextra", "-Werror", "-O1"])
        .args(options)
        .arg(source)
        .arg("-o")
        .arg(&program)
        .arg("-lm")
        .output();
    let compiled = match compiled {
        Ok(output) => output,
        Err(error) => {
            eprintln!("skipped: no compiler ({compiler}: {error})");
            return None;
        }
    };
    assert!(compiled.status.success(), "{compiled:?}");
    let mut child = Command::new(&program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("just compiled");
    let mut stdin = child.stdin.take().expect("piped");
    let input = input.to_owned();
    let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()));
    let output = child.wait_with_output().expect("ends by itself");
    writer.join().expect("no panic").expect("all is read");
    assert!(output.status.success(), "{output:?}");
    std::fs::remove_dir_all(folder).expect("made above");
    Some(String::from_utf8(output.stdout).expect("text"))
}
