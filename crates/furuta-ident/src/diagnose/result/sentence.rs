//! The diagnosis in words.

use super::{Channel, Channels, Diagnosis, Part, Verdict};
use crate::answer::significant;

impl Diagnosis {
    /// The verdict in one sentence, with the number that matters most.
    #[must_use]
    pub fn sentence(&self) -> String {
        if self.unfinished.contains(&Part::Search) {
            return self.so_far();
        }
        match &self.left_out {
            Some(stretch) => format!("{} {}", stretch.sentence(), self.sentence_of(stretch.rest)),
            None => self.sentence_of(self.verdict),
        }
    }

    fn sentence_of(&self, verdict: Verdict) -> String {
        match verdict {
            Verdict::NoGap => "The model predicts these recordings down to the noise floor: nothing is missing.".into(),
            Verdict::ParametersOnly => format!(
                "No effect is missing: with the parameters refitted, {}.",
                change(self.gap.nominal, self.gap.recalibrated)
            ),
            Verdict::MissingEffects => format!(
                "Missing from the model: {}; with {} added, {}.",
                self.effect_names(),
                if self.effects.len() == 1 { "it" } else { "them" },
                self.gain()
            ),
            Verdict::Unexplained if self.effects.is_empty() => {
                "Something is missing that no effect of the catalogue explains: nothing is named rather than the \
                 nearest guess.".into()
            }
            Verdict::Unexplained => format!(
                "With {} added, {}, but something remains that no effect of the catalogue explains.",
                self.effect_names(),
                self.gain()
            ),
        }
    }

    /// The sentence of a search that was broken off.
    fn so_far(&self) -> String {
        let ended = if self.interrupted {
            "Interrupted"
        } else {
            "Out of time"
        };
        if self.effects.is_empty() {
            return format!(
                "{ended} before any effect was named: with the parameters refitted, {}.",
                change(self.gap.nominal, self.gap.recalibrated)
            );
        }
        format!(
            "{ended}; found so far: {}; with {} added, {}.",
            self.effect_names(),
            if self.effects.len() == 1 {
                "it"
            } else {
                "them"
            },
            self.gain()
        )
    }

    /// What Ctrl-C or the time limit left undone, in one sentence; nothing where there was neither.
    #[must_use]
    pub fn interruption(&self) -> Option<String> {
        let undone: Vec<&str> = self.unfinished.iter().map(|part| part.undone()).collect();
        let (ended, advice) = if self.interrupted {
            ("The diagnosis was interrupted", "")
        } else {
            (
                "The time limit ended the diagnosis",
                " A longer time limit lets it end, or fewer samples (every, span).",
            )
        };
        (!undone.is_empty()).then(|| format!("{ended}: {}.{advice}", undone.join("; ")))
    }

    fn effect_names(&self) -> String {
        let names: Vec<String> = self
            .effects
            .iter()
            .map(|effect| within_sentence(&effect.name))
            .collect();
        match names.as_slice() {
            [] => "nothing".into(),
            [only] => only.clone(),
            [first @ .., last] => format!("{} and {last}", first.join(", ")),
        }
    }

    /// What the named effects change, on data kept apart where there are such.
    fn gain(&self) -> String {
        match &self.held_out {
            Some(apart) if apart.recalibrated.theta.is_finite() => format!(
                "on data kept apart {}",
                change(apart.recalibrated, apart.augmented)
            ),
            _ => change(self.gap.recalibrated, self.gap.augmented),
        }
    }
}

/// "the prediction error of the arm falls from 0.46 to 0.0021 rad", for the angle on which the change is largest, and
/// for each on which it rises.
fn change(before: Channels, after: Channels) -> String {
    let ratio = |channel: Channel| {
        let ratio = before.get(channel) / after.get(channel);
        if ratio.is_finite() { ratio } else { 0.0 }
    };
    let mut channels = Channel::ALL;
    channels.sort_by(|a, b| ratio(*b).total_cmp(&ratio(*a)));
    let said = |channel: Channel| {
        let (before, after) = (before.get(channel), after.get(channel));
        let (from, to) = (significant(before, 2), significant(after, 2));
        let verb = match () {
            () if from == to => return ("stays", format!("stays at {to} rad")),
            () if after < before => "falls",
            () => "rises",
        };
        (verb, format!("{verb} from {from} to {to} rad"))
    };
    let is_known =
        |channel: &Channel| before.get(*channel).is_finite() && after.get(*channel).is_finite();
    let mut known = channels
        .into_iter()
        .filter(is_known)
        .map(|channel| (channel, said(channel)));
    let Some((best, (verb, first))) = known.next() else {
        return "the prediction comes closer to the recordings".into();
    };
    let error = |channel: Channel, said: &str| {
        format!("the prediction error of the {} {said}", channel.part())
    };
    match known.next() {
        // What stays need not be said beside what rises.
        Some((worse, ("rises", last))) if verb == "stays" => error(worse, &last),
        Some((worse, ("rises", last))) => {
            let link = if verb == "rises" { "and" } else { "but" };
            format!(
                "{}, {link} that of the {} {last}",
                error(best, &first),
                worse.part()
            )
        }
        _ => error(best, &first),
    }
}

/// A name as it stands within a sentence: its first letter small, but for names of people.
fn within_sentence(name: &str) -> String {
    let mut characters = name.chars();
    match characters.next() {
        Some(first)
            if !["Coulomb", "Stribeck", "Dahl"]
                .iter()
                .any(|person| name.starts_with(person)) =>
        {
            first.to_lowercase().collect::<String>() + characters.as_str()
        }
        _ => name.into(),
    }
}
