//! The CSV file that a log was converted from, kept whole within it. What a number means survives any conversion; how somebody wrote it
//! (`1.50`, the order of the columns, a blank line) only so.

use std::borrow::Cow;

use ::mcap::Attachment;

use super::Recording;

/// Name of the attachment.
const NAME: &str = "source.csv";

pub(super) fn attachment(csv: &[u8]) -> Attachment<'_> {
    Attachment {
        log_time: 0,
        create_time: 0,
        name: NAME.into(),
        media_type: "text/csv".into(),
        data: Cow::Borrowed(csv),
    }
}

/// The CSV file that this MCAP log was converted from, byte for byte; `None` where it holds none, is cut off, or where the samples beside it
/// are not those of the file any more.
#[must_use]
pub fn kept_source(mcap: &[u8]) -> Option<Vec<u8>> {
    let summary = ::mcap::Summary::read(mcap).ok()??;
    let index = summary
        .attachment_indexes
        .iter()
        .find(|index| index.name == NAME)?;
    let source = ::mcap::read::attachment(mcap, index)
        .ok()?
        .data
        .into_owned();
    let (of_source, _) = Recording::from_csv(NAME, &source).ok()?;
    let (of_log, _) = Recording::from_mcap(NAME, mcap).ok()?;
    (samples(of_source)? == samples(of_log)?).then_some(source)
}

/// The samples in our own writing, which tells any two bits apart.
fn samples(mut recording: Recording) -> Option<Vec<u8>> {
    recording.comments.clear();
    recording.metadata.clear();
    recording.rig = None;
    // Columns of a log's own names come first there.
    recording.extra.sort_by(|a, b| a.name.cmp(&b.name));
    let mut csv = Vec::new();
    recording.to_csv(&mut csv).ok()?;
    Some(csv)
}
