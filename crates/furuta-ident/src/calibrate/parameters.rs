//! The numbers of a rig file that can be calibrated, by their keys, and how a plain vector of them becomes a plant.

use furuta_model::effects::MAX_PARAMETERS;
use furuta_model::params::{Coefficients, RANGES};
use furuta_model::{Effect, Jet, Params, Plant, Rig};

use crate::pendulum::Pendulum;
use crate::shooting::{Late, MAX_FREE, Pass, ZEROS, is_late};

/// The most that are fitted at once, beside a recording's zeros.
const MOST: usize = MAX_FREE - ZEROS;
/// By which factor a parameter may differ from the rig file.
const MOST_FACTOR: f64 = 20.0;
/// Keys of the rig file in the order in which they are preferred: what a ruler, a balance and a data sheet know least
/// comes first.
const ORDER: [&str; 16] = [
    "motor.torque_constant",
    "arm.inertia",
    "arm.viscous",
    "pendulum.inertia",
    "pendulum.viscous",
    "arm.length",
    "pendulum.inertia_transverse",
    "motor.back_emf_constant",
    "pendulum.com",
    "pendulum.mass",
    "motor.resistance",
    "pendulum.inertia_axial",
    "motor.efficiency",
    "motor.amplifier_gain",
    "motor.gear_ratio",
    "environment.gravity",
];
const ARM_LENGTH: usize = 0;
const ARM_INERTIA: usize = 1;
const MASS: usize = 3;
const COM: usize = 4;
const INERTIA: usize = 5;
const TRANSVERSE: usize = 6;
const AXIAL: usize = 7;

/// Where in a rig a parameter stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// Of [`RANGES`].
    Rig(usize),
    /// Of the rig's effects, and of that effect's parameters.
    Effect(usize, usize),
}

/// One number of a rig.
#[derive(Clone, Debug)]
pub(super) struct Parameter {
    /// As in the rig file: `arm.inertia`, `arm.coulomb.torque`.
    pub(super) key: String,
    pub(super) unit: String,
    pub(super) sheet: f64,
    /// Its natural size: the rig file's value, or a guess where that is zero. Deviations are counted in it.
    pub(super) scale: f64,
    low: f64,
    high: f64,
    place: Place,
}

/// All that can be calibrated of a rig.
#[derive(Clone, Debug)]
pub(super) struct Space {
    pub(super) rig: Rig,
    pub(super) parameters: Vec<Parameter>,
    /// Length of the pendulum's body from the hinge, where it is known, m.
    body: Option<f64>,
    /// Whether the pendulum is a rod: its transverse inertia is that about the hinge's direction, and stays so.
    rod: bool,
}

impl Space {
    /// `transverse`: the inertia about the third axis is a parameter of its own even where the pendulum is a rod.
    pub(super) fn new(rig: &Rig, body: Option<f64>, transverse: bool) -> Self {
        let values = rig.params.to_array();
        let actuation = rig.params.motor.actuation;
        let c = rig.params.coefficients();
        // A damping ratio of one per cent, for files that leave friction out.
        let damping = 0.02 * (c.weight * c.pendulum).sqrt();
        let moment = rig.params.pendulum.mass * rig.params.pendulum.com.powi(2);
        let mut parameters: Vec<Parameter> = ORDER
            .iter()
            .filter(|key| actuation.uses(key))
            .filter_map(|key| RANGES.iter().position(|r| r.key == *key))
            .map(|i| {
                let (range, sheet) = (RANGES[i], values[i]);
                let guess = match range.key {
                    "arm.viscous" | "pendulum.viscous" => damping,
                    "pendulum.inertia"
                    | "pendulum.inertia_transverse"
                    | "pendulum.inertia_axial" => 0.1 * moment,
                    "motor.back_emf_constant" => rig.params.motor.torque_constant,
                    _ => 1.0,
                };
                let scale = if sheet > 0.0 && !range.key.ends_with("viscous") {
                    sheet
                } else {
                    sheet.max(guess)
                };
                let low = if range.min_allowed {
                    range.min
                } else {
                    sheet / MOST_FACTOR
                };
                Parameter {
                    key: range.key.to_owned(),
                    unit: unit(range.unit_for(actuation)),
                    sheet,
                    scale,
                    low,
                    high: range.max.min(MOST_FACTOR * scale),
                    place: Place::Rig(i),
                }
            })
            .collect();
        let p = &rig.params.pendulum;
        let rod = !transverse && (p.inertia_transverse - p.inertia).abs() <= 1e-9 * p.inertia;
        parameters.retain(|q| !(rod && q.place == Place::Rig(TRANSVERSE)));
        for (i, e) in rig.effects.iter().enumerate() {
            let spec = e.spec();
            for (k, (p, value)) in spec.parameters.iter().zip(e.values()).enumerate() {
                if !p.kind.is_continuous() || spec.acts_once() {
                    continue;
                }
                let typical = p.typical(&rig.params);
                parameters.push(Parameter {
                    key: format!("{}.{}", spec.id, p.name),
                    unit: unit(actuation.unit_of(p.unit)),
                    sheet: value,
                    scale: (value - p.off).abs().max(typical),
                    low: p.min,
                    high: p.max,
                    place: Place::Effect(i, k),
                });
            }
        }
        // The vectors of the engine are so long; the last ones are those that a person would free last.
        if parameters.len() > MOST {
            let surplus = parameters.len() - MOST;
            let rigs = parameters
                .iter()
                .take_while(|p| matches!(p.place, Place::Rig(_)))
                .count();
            let rest = parameters.split_off(rigs);
            parameters.truncate(rigs.saturating_sub(surplus));
            parameters.extend(rest);
            parameters.truncate(MOST);
        }
        Self {
            rig: rig.clone(),
            parameters,
            body,
            rod,
        }
    }

    /// Place of a key among the parameters.
    pub(super) fn find(&self, key: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.key == key)
    }

    pub(super) fn sheet(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.sheet).collect()
    }

    /// Whether the transverse inertia follows the other: a rod, and not asked for.
    pub(super) const fn follows(&self) -> bool {
        self.rod
    }

    /// Bounds of the free parameters within which the rig is physical, at these values of all.
    pub(super) fn bounds(&self, values: &[f64], free: &[usize]) -> Vec<(f64, f64)> {
        let all = self.all(values);
        free.iter()
            .map(|&i| {
                let p = &self.parameters[i];
                let (mut low, mut high) = (p.low, p.high);
                if let Some(body) = self.body {
                    // Mass between hinge and tip: the centre of mass is there, and m c² + I = integral of r² dm <= l *
                    // integral of r dm.
                    let (m, c) = (all[MASS], all[COM]);
                    if p.place == Place::Rig(COM) {
                        high = high.min(body);
                    }
                    if p.place == Place::Rig(INERTIA) {
                        high = high.min((m * c * (body - c)).max(0.0));
                    }
                }
                // About a body's own axes, none of the three inertias exceeds the other two together; files with a flat
                // or a point-like pendulum (transverse 0, as in the papers) already break that, and are left alone.
                let sheet = &self.rig.params.pendulum;
                let sane = sheet.inertia
                    <= (sheet.inertia_transverse + sheet.inertia_axial) * (1.0 + 1e-9)
                    && sheet.inertia_transverse
                        <= (sheet.inertia + sheet.inertia_axial) * (1.0 + 1e-9);
                if sane && p.place == Place::Rig(AXIAL) {
                    low = low.max((all[INERTIA] - all[TRANSVERSE]).abs());
                    high = high.min(all[INERTIA] + all[TRANSVERSE]);
                }
                (low, high.max(low))
            })
            .collect()
    }

    /// The seventeen values of the rig file, followed parameters with them.
    fn all(&self, values: &[f64]) -> [f64; 17] {
        let mut all = self.rig.params.to_array();
        for (p, v) in self.parameters.iter().zip(values) {
            if let Place::Rig(k) = p.place {
                all[k] = *v;
            }
        }
        if self.follows() {
            all[TRANSVERSE] = all[INERTIA];
        }
        all
    }

    /// What the equations of motion are made of, with the derivatives of a pass with respect to the numbers that are
    /// `free`, in units of their scales.
    pub(super) fn coefficients<const N: usize>(
        &self,
        values: &[f64],
        free: &[usize],
        pass: Pass,
    ) -> Coefficients<Jet<f64, N>> {
        let mut all = self.all(values).map(Jet::<f64, N>::constant);
        for (k, &i) in free.iter().enumerate() {
            let derivative = pass.derivative::<N>(k);
            if let (Place::Rig(range), Some(d)) = (self.parameters[i].place, derivative) {
                all[range].d[d] = self.parameters[i].scale;
            }
        }
        if self.follows() {
            all[TRANSVERSE] = all[INERTIA];
        }
        Params::from_array(self.rig.params.motor.actuation, all).coefficients()
    }

    /// The plant of a rig in this state, and by how much it is late.
    pub(super) fn plant<const N: usize>(
        &self,
        values: &[f64],
        free: &[usize],
        pass: Pass,
        state: Pendulum,
    ) -> (Plant<Jet<f64, N>>, Late<Jet<f64, N>>) {
        let coefficients = state.coefficients(self.coefficients::<N>(values, free, pass));
        let mut late = Late::by(Jet::constant(0.0));
        let mut effects = Vec::new();
        for (i, e) in (self.rig.effects.iter().enumerate()).filter(|(_, e)| state.has(e.spec())) {
            let mut v: arrayvec::ArrayVec<Jet<f64, N>, MAX_PARAMETERS> =
                e.values().iter().map(|v| Jet::constant(*v)).collect();
            for (j, (p, value)) in self.parameters.iter().zip(values).enumerate() {
                let Place::Effect(of, k) = p.place else {
                    continue;
                };
                if of != i {
                    continue;
                }
                v[k] = Jet::constant(*value);
                let at = free.iter().position(|&f| f == j);
                if let Some(d) = at.and_then(|at| pass.derivative::<N>(at)) {
                    v[k].d[d] = p.scale;
                }
            }
            effects.extend(Effect::of(e.spec(), &v).filter(|e| !late.add(e)));
        }
        let plant = Plant::from_coefficients(coefficients, &effects);
        (plant.unwrap_or_else(|_| Plant::unknown()), late)
    }

    /// The rig with these values.
    pub(super) fn rig(&self, values: &[f64]) -> Rig {
        let mut rig = self.rig.clone();
        rig.params = Params::from_array(self.rig.params.motor.actuation, self.all(values));
        rig.effects = rig
            .effects
            .iter()
            .enumerate()
            .map(|(i, e)| {
                let mut v = e.values();
                for (p, value) in self.parameters.iter().zip(values) {
                    if let Place::Effect(of, k) = p.place
                        && of == i
                    {
                        v[k] = *value;
                    }
                }
                Effect::of(e.spec(), &v).unwrap_or(*e)
            })
            .collect();
        rig
    }

    /// Whether an effect depends on the arm's absolute angle.
    pub(super) fn sees_angle(&self) -> bool {
        let effects = &self.rig.effects;
        effects.iter().any(|e| e.spec().sees_angle())
    }

    /// Whether each effect that depends on the arm's angle is free to turn with it: its angle of rest, or its phase, is
    /// one of these. Then nothing else says where an encoder reads zero.
    pub(super) fn turns(&self, free: &[usize]) -> bool {
        let turned: Vec<usize> = (free.iter())
            .filter_map(|&i| match self.parameters[i].place {
                Place::Effect(of, k) => Some((of, k)),
                Place::Rig(_) => None,
            })
            .filter(|&(of, k)| self.rig.effects[of].spec().origin() == Some(k))
            .map(|(of, _)| of)
            .collect();
        let mut effects = self.rig.effects.iter().enumerate();
        effects.all(|(i, e)| turned.contains(&i) || !e.spec().sees_angle())
    }

    /// By how much the rig file's delays make everything late, s.
    pub(super) fn late(&self) -> f64 {
        let late = self.rig.effects.iter().filter(|e| is_late(e.spec()));
        late.map(|e| e.values()[0]).sum()
    }

    /// The least that the coefficients may be for the bodies named in the rig file to be real, in the order arm,
    /// pendulum: a point mass at the arm's end, and one at the centre of mass. The last is the most that the pendulum's
    /// inertia about the hinge can be.
    pub(super) fn point_masses(&self) -> ([f64; 2], Option<f64>) {
        let all = self.rig.params.to_array();
        let (m, l, c) = (all[MASS], all[ARM_LENGTH], all[COM]);
        let hub = all[ARM_INERTIA] / MOST_FACTOR;
        let most = self.body.map(|body| m * c * body);
        ([m * l * l + hub, m * c * c], most)
    }
}

fn unit(unit: &str) -> String {
    if unit == "-" { "1" } else { unit }.to_owned()
}
