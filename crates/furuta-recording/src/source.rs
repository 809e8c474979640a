//! The CSV file that a log was converted from, kept whole within it. What a number means survives any conversion; how
//! it was written (`1.50`, the order of the columns, a blank line) survives only here. It is given back while the
//! samples beside it are those that were converted.

use std::collections::BTreeMap;

/// Name of the attachment.
pub(super) const NAME: &str = "source.csv";
/// Name of the metadata record that tells the samples of that file.
pub(super) const MARK: &str = "furuta.source";

/// Number and checksum of samples.
#[derive(Clone, Default)]
pub(super) struct Digest {
    samples: u64,
    crc: crc32fast::Hasher,
}

impl Digest {
    pub(super) fn add(&mut self, message: &[u8]) {
        self.samples += 1;
        self.crc.update(message);
    }

    pub(super) fn to_map(&self) -> BTreeMap<String, String> {
        let crc = self.crc.clone().finalize();
        BTreeMap::from([
            ("samples".to_owned(), self.samples.to_string()),
            ("crc32".to_owned(), format!("{crc:08x}")),
        ])
    }
}
