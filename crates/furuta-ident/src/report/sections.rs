//! The page's sections, each a piece of HTML; an empty string where there is nothing to show.

use core::fmt::Write as _;

use super::{charts, encode, escape};
use crate::diagnose::result::{
    Channel, Curves, Diagnosis, Jitter, NamedEffect, Part, RunCurves, Verdict, plain, significant,
};

pub(super) fn verdict(diagnosis: &Diagnosis, curves: &Curves) -> String {
    let word = match diagnosis.verdict {
        Verdict::NoGap => "no gap",
        Verdict::ParametersOnly => "parameters only",
        Verdict::MissingEffects if diagnosis.effects.len() == 1 => "one effect is missing",
        Verdict::MissingEffects => "effects are missing",
        Verdict::Unexplained => "unexplained",
    };
    let rig = if curves.rig.is_empty() {
        "a rig".into()
    } else {
        escape(&curves.rig)
    };
    let seconds: f64 = curves
        .runs
        .iter()
        .filter_map(|run| Some(run.t.last()? - run.t.first()?))
        .sum();
    let data = match curves.runs.len() {
        0 => String::new(),
        1 => format!(" from one recording of {seconds:.0} s"),
        n => format!(" from {n} recordings, {seconds:.0} s in all"),
    };
    let interruption = diagnosis.interruption().map_or_else(String::new, |s| {
        format!("<p class=\"lead\">{}</p>", escape(&s))
    });
    format!(
        "<header><p class=\"eyebrow\"><b>furuta diagnose</b> · {rig}{data}</p>\
         <span class=\"badge {}\">{word}</span><h1>{}</h1>{interruption}</header>\n{}",
        diagnosis.verdict,
        escape(&diagnosis.sentence()),
        gap(diagnosis)
    )
}

/// The error of prediction by model: table and picture side by side.
fn gap(diagnosis: &Diagnosis) -> String {
    let gap = &diagnosis.gap;
    let ladder = charts::ladder(gap);
    if ladder.is_empty() {
        return String::new();
    }
    let horizon = if gap.horizon.is_finite() {
        format!(
            " over {} s from estimated states",
            significant(gap.horizon, 2)
        )
    } else {
        String::new()
    };
    let rows = Channel::ALL.map(|channel| {
        let cell =
            |value: f64, class: &str| format!("<td class=\"n {class}\">{}</td>", number(value, 3));
        format!(
            "<tr><td>{}</td>{}{}{}{}</tr>",
            channel.part(),
            cell(gap.nominal.get(channel), ""),
            cell(gap.recalibrated.get(channel), ""),
            cell(gap.augmented.get(channel), "best"),
            cell(gap.noise_floor.get(channel), "")
        )
    });
    let held_out = diagnosis
        .held_out
        .as_ref()
        .map_or_else(String::new, |held_out| {
            let part = |channel: Channel| {
                format!(
                    "{} {} → <b>{}</b> rad (floor {})",
                    channel.part(),
                    number(held_out.recalibrated.get(channel), 3),
                    number(held_out.augmented.get(channel), 3),
                    number(held_out.noise_floor.get(channel), 3)
                )
            };
            let [theta, alpha] = Channel::ALL.map(part);
            format!(
                "<p class=\"note\">On data kept apart from search and fit: {theta}, {alpha}.</p>"
            )
        });
    format!(
        "<section class=\"card\"><div class=\"grid2\"><div class=\"scroll\"><table><thead><tr><th>RMS error, \
         rad</th><th class=\"n\"><span class=\"key\"><i class=\"dot nominal\"></i>rig file</span></th>\
         <th class=\"n\"><span class=\"key\"><i class=\"dot before\"></i>refitted</span></th><th class=\"n\"><span \
         class=\"key\"><i class=\"dot after\"></i>repaired</span></th>\
         <th class=\"n\"><span class=\"key\"><i \
         class=\"floor\"></i>noise</span></th></tr></thead><tbody>{}</tbody></table></div><div>{ladder}</div></div>\
         <p class=\"note\">Prediction{horizon}: by the rig file as given, with its parameters refitted, and repaired \
         with the effects named. No model can be better than the noise.</p>{held_out}</section>\n",
        rows.concat()
    )
}

pub(super) fn effects(diagnosis: &Diagnosis, curves: &Curves) -> String {
    if diagnosis.effects.is_empty() {
        return String::new();
    }
    let compared = !diagnosis.unfinished.contains(&Part::Rivals);
    let cards: String = diagnosis
        .effects
        .iter()
        .map(|e| effect(e, compared))
        .collect();
    let whole = curves.repaired_rig.as_ref().map_or_else(String::new, |rig| {
        format!(
            "<details><summary>The whole repaired rig file, with refitted parameters</summary><div \
             class=\"snippet\"><button data-copy>copy</button><pre>{}</pre></div></details>",
            escape(rig)
        )
    });
    format!(
        "<section><h2>What the model is missing</h2>{cards}\
         <p class=\"lead\">Paste this into the rig file, and <code>simulate</code>, <code>design</code> and \
         <code>run</code> use it:</p>\
         <div class=\"snippet\"><button data-copy>copy</button><pre>{}</pre></div>{whole}</section>\n",
        escape(&snippet(&diagnosis.effects))
    )
}

fn effect(effect: &NamedEffect, compared: bool) -> String {
    let spec = furuta_model::effects::spec(&effect.id);
    let says = spec.map_or_else(String::new, |spec| {
        format!(
            "<p class=\"says\">{} {}</p><p class=\"note\">Law: <code>{}</code></p>",
            escape(spec.sentence),
            escape(spec.shows),
            escape(spec.law)
        )
    });
    let mut facts = String::new();
    for (name, estimate) in &effect.parameters {
        let unit = plain(&estimate.unit);
        let _ = write!(
            facts,
            "<div class=\"fact\"><span class=\"label\">{}</span><span class=\"value\">{} <small>{} \
             {}</small></span></div>",
            escape(name),
            match &estimate.word {
                Some(word) => escape(word),
                None => number(estimate.value, digits(estimate.value, estimate.std)),
            },
            if estimate.std.is_finite() {
                format!(
                    "<span title=\"one standard deviation\">± {}</span>",
                    significant(estimate.std, 2)
                )
            } else {
                String::new()
            },
            escape(unit)
        );
    }
    if effect.delta_bic.is_finite() {
        let _ = write!(
            facts,
            "<div class=\"fact\" title=\"Fall of the Bayesian information criterion; above 10 counts as very \
             strong\"><span class=\"label\">evidence</span><span class=\"value\">{:.0} \
             <small>ΔBIC</small></span></div>",
            effect.delta_bic
        );
    }
    if effect.held_out_gain.is_finite() {
        let _ = write!(
            facts,
            "<div class=\"fact\"><span class=\"label\">held-out error removed</span><span class=\"value\">{:.0} \
             <small>%</small></span></div>",
            100.0 * effect.held_out_gain
        );
    }
    let confusable = if effect.confusable_with.is_empty() {
        String::new()
    } else {
        let ids: Vec<String> = effect
            .confusable_with
            .iter()
            .map(|id| format!("<code>{}</code>", escape(id)))
            .collect();
        format!(
            "<p class=\"note\">{} {}.</p>",
            if compared {
                "These data are explained nearly as well by"
            } else {
                "Not compared with"
            },
            ids.join(", ")
        )
    };
    format!(
        "<article class=\"card effect\"><header><h3>{}</h3><code class=\"id\">{}</code></header>{says}<div \
         class=\"facts\">{facts}</div>{confusable}</article>\n",
        escape(&effect.name),
        escape(&effect.id)
    )
}

/// The empirical expression, marked as what it is.
pub(super) fn expression(diagnosis: &Diagnosis) -> String {
    let Some(custom) = &diagnosis.custom else {
        return String::new();
    };
    let torques: String = custom
        .torques()
        .iter()
        .map(|t| format!("<p><code>{} N m</code></p>", escape(t)))
        .collect();
    let rows: String = custom
        .terms
        .iter()
        .filter_map(|t| Some((t, t.parameters.get("coefficient")?)))
        .map(|(t, c)| {
            format!(
                "<div class=\"fact\"><span class=\"label\">{}</span><span class=\"value\">{} <small>± {} \
                 {}</small></span></div>",
                escape(&t.id),
                number(c.value, digits(c.value, c.std)),
                significant(c.std, 2),
                escape(&c.unit)
            )
        })
        .collect();
    let part = |channel: Channel| {
        format!(
            "{} {} → <b>{}</b> rad",
            channel.part(),
            number(custom.without.get(channel), 3),
            number(custom.with.get(channel), 3)
        )
    };
    let [theta, alpha] = Channel::ALL.map(part);
    format!(
        "<section><h2>An expression for the rest</h2><article class=\"card effect\"><header><h3>Empirical \
         torque</h3><code class=\"id\">fitted, no law</code></header>\
         {torques}<p class=\"says\">{} It says nothing of why, and nothing outside the motions recorded.</p><div \
         class=\"facts\">{rows}</div>\
         <p class=\"note\">On data kept apart from search and fit, without and with it: {theta}, {alpha}. Angles in \
         rad, speeds in rad/s, u the command in its unit.</p></article></section>\n",
        escape(&custom.sentence())
    )
}

/// The effects as tables of a rig file.
fn snippet(effects: &[NamedEffect]) -> String {
    let mut text = String::new();
    for effect in effects {
        if !text.is_empty() {
            text.push('\n');
        }
        let own = furuta_model::effects::spec(&effect.id).and_then(|spec| spec.own);
        if let Some(laws) = own {
            let _ = writeln!(text, "[hypothesis.\"{}\"]\n{}", effect.id, laws.text());
        }
        let _ = writeln!(text, "[effects.\"{}\"]", effect.id);
        for (name, estimate) in &effect.parameters {
            // Six digits are beyond any standard deviation; `{:?}` of a float is a float in TOML too.
            let value: f64 = format!("{:.5e}", estimate.value)
                .parse()
                .unwrap_or(estimate.value);
            let spread = if estimate.std.is_finite() {
                format!(" +- {}", significant(estimate.std, 2))
            } else {
                String::new()
            };
            let _ = writeln!(
                text,
                "{:<22} # {}{spread}",
                format!("{name} = {value:?}"),
                estimate.unit
            );
        }
    }
    text
}

pub(super) fn runs(diagnosis: &Diagnosis, curves: &Curves) -> String {
    let window = if diagnosis.gap.horizon.is_finite() {
        format!(
            " Each model predicts {} s ahead, then starts anew from the estimated state.",
            significant(diagnosis.gap.horizon, 2)
        )
    } else {
        String::new()
    };
    plot(
        "Measured against predicted",
        &format!("The recordings, and what the models make of their commands.{window}"),
        "runs",
        &curves.runs,
    )
}

fn plot(title: &str, lead: &str, id: &str, runs: &[RunCurves]) -> String {
    if runs.iter().all(|run| run.t.len() < 2) {
        return String::new();
    }
    let runs: Vec<RunCurves> = runs.iter().filter(|run| run.t.len() > 1).cloned().collect();
    let has = |series: fn(&RunCurves) -> &[Vec<f64>; 2]| {
        runs.iter()
            .any(|run| series(run).iter().any(|values| !values.is_empty()))
    };
    let models = [
        (
            "nominal",
            "nominal",
            "rig file as given",
            has(|run| &run.nominal),
        ),
        (
            "recalibrated",
            "before",
            "refitted",
            has(|run| &run.recalibrated),
        ),
        ("augmented", "after", "repaired", has(|run| &run.augmented)),
    ];
    let buttons: String = models
        .iter()
        .filter(|(.., there)| *there)
        .map(|(key, class, word, _)| {
            format!(
                "<button data-model=\"{key}\"><span class=\"key\"><i \
                                              class=\"{class}\"></i>{word}</span></button>"
            )
        })
        .collect();
    let choice = if runs.len() > 1 {
        let options: String = runs
            .iter()
            .map(|run| {
                format!(
                    "<option>{}{}</option>",
                    escape(&run.name),
                    if run.held_out { " (held out)" } else { "" }
                )
            })
            .collect();
        format!("<select aria-label=\"recording\">{options}</select>")
    } else {
        runs.first().map_or_else(String::new, |run| {
            format!("<span class=\"note\">{}</span>", escape(&run.name))
        })
    };
    let stride = encode::stride(&runs);
    let thinned = if stride > 1 {
        format!("<p class=\"note\">Shown is one sample in {stride}, to keep this page small.</p>")
    } else {
        String::new()
    };
    format!(
        "<section><h2>{title}</h2><p class=\"lead\">{lead}</p><div class=\"card plot\" data-source=\"data-{id}\"><div \
         class=\"bar\">{choice}\
         <span class=\"key note\"><i class=\"measured\"></i>measured</span>{buttons}<button class=\"push\" \
         data-whole>whole run</button></div>\
         <div><canvas tabindex=\"0\" role=\"img\" aria-label=\"{title}\"></canvas></div><p class=\"readout\"></p>\
         <noscript>The curves are drawn by a script in this page.</noscript></div>{thinned}\
         <script type=\"application/json\" id=\"data-{id}\">{}</script></section>\n",
        encode::runs(&runs)
    )
}

pub(super) fn location(diagnosis: &Diagnosis, curves: &Curves) -> String {
    if diagnosis.location.is_empty() && curves.bars.is_empty() {
        return String::new();
    }
    let mut largest: Vec<_> = diagnosis
        .location
        .iter()
        .filter(|share| share.share_of_gap.is_finite())
        .collect();
    largest.sort_by(|a, b| b.share_of_gap.total_cmp(&a.share_of_gap));
    let items: String = largest
        .iter()
        .take(6)
        .map(|share| {
            format!(
                "<li><b>{:.0} %</b> of the {}'s gap in {} lies where <code>{}</code></li>",
                100.0 * share.share_of_gap,
                share.channel.part(),
                if share.run == "all" {
                    "all recordings together".into()
                } else {
                    escape(&share.run)
                },
                escape(&share.condition)
            )
        })
        .collect();
    let list = if items.is_empty() {
        String::new()
    } else {
        format!("<ul>{items}</ul>")
    };
    let chart = if curves.bars.is_empty() {
        String::new()
    } else {
        format!(
            "<div class=\"card\"><div class=\"legend\"><span class=\"key\"><i \
             class=\"before\"></i>refitted</span><span class=\"key\"><i class=\"after\"></i>repaired</span>\
             <span class=\"key\"><i class=\"floor\"></i>noise floor = 1</span></div>{}<p class=\"note\">RMS error \
             under each condition, in multiples of the noise floor: before → after.</p></div>",
            charts::gap_bars(&curves.bars)
        )
    };
    format!("<section><h2>Where the gap sits</h2>{list}{chart}</section>\n")
}

pub(super) fn evidence(diagnosis: &Diagnosis, curves: &Curves) -> String {
    if curves.evidence.is_empty() {
        return String::new();
    }
    let named = if diagnosis.effects.is_empty() {
        ""
    } else {
        " Those named in the end are coloured: a candidate that looks strong alone may be explained away by another."
    };
    format!(
        "<section><h2>What was tried</h2><p class=\"lead\">Each candidate added alone to the refitted model: the \
         evidence (fall of the Bayesian information criterion, \
         logarithmic).{named}</p><div class=\"card\">{}</div></section>\n",
        charts::evidence(&curves.evidence)
    )
}

pub(super) fn limits(diagnosis: &Diagnosis) -> String {
    if let Some(why) = diagnosis.why_no_limits() {
        return format!(
            "<section><h2>What was ruled out</h2><p class=\"lead\">{}</p></section>\n",
            escape(why)
        );
    }
    if diagnosis.limits.is_empty() {
        return String::new();
    }
    let mut rows = String::new();
    for l in &diagnosis.limits {
        rows += &format!(
            "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td>{}</td><td class=\"n\">{:.1} %</td></tr>",
            escape(&l.id),
            escape(&l.parameter),
            significant(l.at_most, 2),
            escape(plain(&l.unit)),
            100.0 * l.at_most / l.typical
        );
    }
    format!(
        "<section><h2>What was ruled out, and how firmly</h2><p class=\"lead\">How large each effect that is not named \
         could still be, at a confidence of 95 %, beside \
         what is named; the last column compares that with a size that would be noticed on this rig.</p><div \
         class=\"card scroll\"><table><thead><tr><th>effect</th><th>parameter</th>\
         <th class=\"n\">at most</th><th>unit</th><th class=\"n\">of a noticeable \
         size</th></tr></thead><tbody>{rows}</tbody></table></div></section>\n"
    )
}

pub(super) fn parameters(diagnosis: &Diagnosis) -> String {
    if diagnosis.parameters.is_empty() {
        return String::new();
    }
    let mut rows = String::new();
    for (name, parameter) in &diagnosis.parameters {
        let change = 100.0 * (parameter.fitted / parameter.nominal - 1.0);
        let fitted = if parameter.identifiable {
            format!(
                "<td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>yes</td>",
                number(parameter.fitted, digits(parameter.fitted, parameter.std)),
                if parameter.std.is_finite() {
                    format!("± {}", significant(parameter.std, 2))
                } else {
                    "–".into()
                },
                if change.is_finite() {
                    format!("{change:+.1} %")
                } else {
                    "–".into()
                }
            )
        } else {
            "<td class=\"n unknown\">kept</td><td class=\"n unknown\">–</td><td class=\"n unknown\">–</td><td \
             class=\"unknown\">no</td>".into()
        };
        let _ = write!(
            rows,
            "<tr><td><code>{}</code></td><td class=\"n\">{}</td>{fitted}<td>{}</td></tr>",
            escape(name),
            number(parameter.nominal, 4),
            escape(plain(&parameter.unit))
        );
    }
    format!(
        "<section><h2>Parameters</h2><p class=\"lead\">Commands and angles fix every mass and inertia only up to one \
         common factor, so <code>mass × com</code> is kept at the rig file's value \
         and torques are in its units.</p><div class=\"card scroll\"><table><thead><tr><th>parameter</th><th \
         class=\"n\">rig file</th><th class=\"n\">refitted</th><th class=\"n\">std</th>\
         <th class=\"n\">change</th><th>identifiable</th><th>unit</th></tr></thead><tbody>{rows}</tbody></table></div>\
         </section>\n"
    )
}

pub(super) fn verification(diagnosis: &Diagnosis, curves: &Curves) -> String {
    if diagnosis.verification.is_empty() && curves.verification.is_empty() {
        return String::new();
    }
    let mut rows = String::new();
    for row in &diagnosis.verification {
        let _ = write!(
            rows,
            "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n best\">{}</td></tr>",
            escape(&row.run),
            row.channel.part(),
            number(row.nominal, 3),
            number(row.recalibrated, 3),
            number(row.repaired, 3)
        );
    }
    let table = if rows.is_empty() {
        String::new()
    } else {
        format!(
            "<div class=\"card scroll\"><table><thead><tr><th>recording</th><th>angle</th><th class=\"n\">rig \
             file</th><th class=\"n\">refitted</th><th class=\"n\">repaired</th></tr></thead>\
             <tbody>{rows}</tbody></table><p class=\"note\">RMS error over the whole run, rad.</p></div>"
        )
    };
    let heading = format!(
        "<section><h2>Verified on recordings the search never saw</h2><p class=\"lead\">Predicted from the first \
         sample to the last, from the command alone.</p>{table}</section>\n"
    );
    heading
        + &plot(
            "The verified runs",
            "The whole runs, without starting anew.",
            "verified",
            &curves.verification,
        )
}

pub(super) fn next_experiment(diagnosis: &Diagnosis) -> String {
    let Some(next) = &diagnosis.next_experiment else {
        return String::new();
    };
    format!(
        "<section><h2>What to measure next</h2><div class=\"card next\"><p>{}</p>{}</div></section>\n",
        escape(next),
        plan(diagnosis)
    )
}

/// The experiments, the clearest first, and how to record the first.
fn plan(diagnosis: &Diagnosis) -> String {
    let Some(first) = diagnosis.plan.first() else {
        return String::new();
    };
    let rows: String = diagnosis
        .plan
        .iter()
        .map(|row| {
            format!(
                "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td \
                 class=\"n\">{}</td><td><code>{}</code> or <code>{}</code></td><td class=\"n\">{:.0}</td></tr>",
                escape(&row.excitation),
                number(row.seconds, 2),
                number(row.volts, 2),
                number(row.volts_rms, 2),
                escape(&row.separates[0]),
                escape(&row.separates[1]),
                row.expected_evidence
            )
        })
        .collect();
    format!(
        "<div class=\"scroll\"><table><thead><tr><th>experiment</th><th class=\"n\">s</th><th class=\"n\">V \
         peak</th><th class=\"n\">V RMS</th><th>tells apart</th>\
         <th class=\"n\">expected ΔBIC</th></tr></thead><tbody>{rows}</tbody></table></div>\
         <p class=\"note\">Expected from simulations of both with these encoders, whichever is right; above 10 counts \
         as very strong. To record the first:</p>\
         <div class=\"snippet\"><button data-copy>copy</button><pre>furuta run --port PORT --rig RIG.toml --task {} \
         --log next.mcap</pre></div>",
        escape(&first.arguments)
    )
}

pub(super) fn notices(diagnosis: &Diagnosis) -> String {
    let jitter = diagnosis.jitter.iter().map(Jitter::sentence);
    let items: String = (diagnosis.notices.iter().cloned().chain(jitter))
        .map(|notice| format!("<li>{}</li>", escape(&notice)))
        .collect();
    if items.is_empty() {
        return items;
    }
    format!("<section><h2>About the recordings</h2><ul>{items}</ul></section>\n")
}

pub(super) fn footer(diagnosis: &Diagnosis) -> String {
    let took = if diagnosis.seconds.is_finite() {
        format!(" in {:.1} s", diagnosis.seconds)
    } else {
        String::new()
    };
    format!(
        "<footer>furuta {}, diagnosed{took}. SI units, radians; alpha is zero upright. The same numbers are in the \
         JSON of <code>furuta diagnose --json</code>.</footer>\n",
        env!("CARGO_PKG_VERSION")
    )
}

/// As many digits as the standard deviation leaves meaningful, three at least.
fn digits(value: f64, std: f64) -> usize {
    let decades = (value.abs() / std).log10();
    if decades.is_finite() {
        (decades.floor() as usize + 2).clamp(3, 6)
    } else {
        4
    }
}

fn number(value: f64, digits: usize) -> String {
    if value.is_finite() {
        significant(value, digits)
    } else {
        "<span class=\"unknown\">–</span>".into()
    }
}
