//! What must hold of the readers of files, whatever a file holds: no panic, and a mistake is told in one short line
//! that a terminal can show.

use furuta_ctrl::ControllerFile;
use furuta_model::Rig;
use furuta_recording::Recording;

/// Any bytes as a CSV recording; what was read is written and read again with the same samples. As a log in CSV form,
/// too.
pub(crate) fn csv(bytes: &[u8]) {
    match Recording::from_csv("run.csv", bytes) {
        Ok((recording, notices)) => {
            notices.iter().for_each(|notice| told(&notice.to_string()));
            let mut text = Vec::new();
            recording.to_csv(&mut text).expect("memory takes all");
            let (again, _) = Recording::from_csv("run.csv", &text).expect("own writing");
            assert_eq!(again.t, recording.t);
            assert_eq!(again.u, recording.u);
            let _ = recording
                .every(3)
                .map(|few| assert!(few.len() <= recording.len()));
        }
        Err(error) => told(&error.to_string()),
    }
    match furuta_log::read_csv(bytes) {
        Ok(log) => {
            let mut text = Vec::new();
            furuta_log::write_csv(&log, &mut text).expect("memory takes all");
            let again = furuta_log::read_csv(&text).expect("own writing");
            assert_eq!(again.records.len(), log.records.len());
        }
        Err(error) => told(&error.to_string()),
    }
}

/// Any bytes as an MCAP log.
pub(crate) fn mcap(bytes: &[u8]) {
    match Recording::from_mcap("run.mcap", bytes) {
        Ok((_, notices)) => notices.iter().for_each(|notice| told(&notice.to_string())),
        Err(error) => told(&error.to_string()),
    }
    if let Err(error) = furuta_log::read_from(bytes) {
        told(&error.to_string());
    }
    let _ = furuta_log::copy_attachment(bytes, "source.csv", std::io::sink());
}

/// Any text as a rig file; what was read is written and read again.
pub(crate) fn rig_file(bytes: &[u8]) {
    let Ok(text) = core::str::from_utf8(bytes) else {
        return;
    };
    match Rig::from_toml(text) {
        Ok(rig) => assert_eq!(Rig::from_toml(&rig.to_toml()).expect("own writing"), rig),
        Err(error) => told(&error.to_string()),
    }
}

/// Any text as a controller file; what was read is written and read again.
pub(crate) fn controller_file(bytes: &[u8]) {
    let Ok(text) = core::str::from_utf8(bytes) else {
        return;
    };
    match ControllerFile::from_toml(text) {
        Ok(file) => {
            let again = ControllerFile::from_toml(&file.to_toml()).expect("own writing");
            assert_eq!(again, file);
        }
        Err(error) => told(&error.to_string()),
    }
}

fn told(message: &str) {
    assert!(
        message.chars().all(furuta_input::is_printable),
        "{message:?}"
    );
    assert!(message.len() < 4000, "{message}");
}
