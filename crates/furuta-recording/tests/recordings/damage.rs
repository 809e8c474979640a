//! Damaged files and files of nonsense: an error, never a panic.

use furuta_recording::Recording;
use proptest::prelude::*;

use super::{csv, read, swing};

/// Pieces of CSV, right and wrong, in any order: finds what random bytes would not get to.
fn csv_like() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        Just("t,u,theta,alpha\n".to_owned()),
        Just("\n".to_owned()),
        Just("\r".to_owned()),
        Just(",".to_owned()),
        Just("\"".to_owned()),
        Just("#".to_owned()),
        Just("nan".to_owned()),
        Just("1e308".to_owned()),
        any::<f64>().prop_map(|value| value.to_string()),
        (any::<i8>(), any::<f64>()).prop_map(|(t, alpha)| format!("{t},1,2,{alpha}\n")),
        (0_u8..50, -7.0..7.0).prop_map(|(t, alpha)| format!("{t},1,2,{alpha}\n")),
    ];
    proptest::collection::vec(piece, 0..60)
        .prop_map(|pieces| "t,u,theta,alpha\n".to_owned() + &pieces.concat())
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        let _ = Recording::from_csv("x.csv", &bytes);
        let _ = Recording::from_mcap("x.mcap", &bytes);
        let _ = Recording::from_mcap("x.mcap", &[b"\x89MCAP0\r\n".as_slice(), &bytes].concat());
    }

    #[test]
    fn no_text_like_csv_makes_the_reader_panic(text in csv_like()) {
        if let Ok((recording, _)) = Recording::from_csv("x.csv", text.as_bytes()) {
            prop_assert!(recording.sample_period > 0.0 && recording.sample_period.is_finite());
            prop_assert!(recording.t.windows(2).all(|pair| pair[0] < pair[1]));
            prop_assert!(recording.segments.iter().all(|segment| segment.end <= recording.len()));
            prop_assert_eq!(recording.continuous_parts().len(), recording.segments.len());
        }
    }

    #[test]
    fn a_damaged_log_does_not_make_the_reader_panic(at in 0_usize..4000, to in any::<u8>(), keep in 0.0..1.0) {
        let (recording, _) = read(&csv(&swing()[..60])).unwrap();
        let path = std::env::temp_dir().join(format!("furuta-damaged-{}-{:?}.mcap", std::process::id(),
            std::thread::current().id()));
        recording.write_mcap(&path).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        let at = at % bytes.len();
        bytes[at] = to;
        let _ = Recording::from_mcap("x.mcap", &bytes);
        bytes.truncate((keep * bytes.len() as f64) as usize);
        let _ = Recording::from_mcap("x.mcap", &bytes);
    }
}
