//! The report's section on two states of one rig.

use std::fmt::Write as _;

use super::escape;
use crate::answer::significant;
use crate::diagnose::result::{Diagnosis, Difference, Estimate};

/// What recordings of the rig in another state say of the effects named in either; nothing where there are none.
pub(super) fn section(diagnosis: &Diagnosis) -> String {
    let Some(c) = &diagnosis.comparison else {
        return String::new();
    };
    let named = match c.named.as_slice() {
        [] => "nothing is named".to_owned(),
        ids => format!("named: {}", ids.join(", ")),
    };
    let mut rows = String::new();
    for d in &c.differences {
        row(&mut rows, d);
    }
    let table = if rows.is_empty() {
        "<p>No effect is named in either state: nothing differs.</p>".to_owned()
    } else {
        format!(
            "<div class=\"card scroll\"><table><thead><tr><th>effect</th><th>parameter</th><th class=\"n\">here</th>\
             <th class=\"n\">there</th><th>unit</th><th class=\"n\">standard deviations</th><th></th></tr></thead>\
             <tbody>{rows}</tbody></table></div>"
        )
    };
    format!(
        "<section><h2>Another state of the rig</h2><p class=\"lead\">There: {} ({}; verdict {}). Each number is fitted \
         to either state beside all that was named in one of them; above four standard deviations it \
         differs.</p>{table}</section>\n",
        escape(&c.there.join(", ")),
        escape(&named),
        c.verdict
    )
}

fn row(out: &mut String, d: &Difference) {
    let value = |e: &Estimate| format!("{} ± {}", significant(e.value, 3), significant(e.std, 2));
    let unit = match d.here.unit.as_str() {
        "1" => "",
        unit => unit,
    };
    // A string takes everything.
    let _ = write!(
        out,
        "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td><td class=\"n\">{}</td>\
         <td>{}</td></tr>",
        escape(&d.id),
        escape(&d.parameter),
        value(&d.here),
        value(&d.there),
        escape(unit),
        significant(d.deviations.abs(), 2),
        if d.differs {
            "<b>differs</b>"
        } else {
            "no difference shows"
        }
    );
}
