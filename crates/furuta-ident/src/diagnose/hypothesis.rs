//! A model to be fitted: which effects it has, and how a plain vector of numbers becomes a plant.

use furuta_model::effects::{Acts, Kind, MAX_PARAMETERS};
use furuta_model::params::Coefficients;
use furuta_model::{Effect, Jet, Params, Plant, Rig, Spec};

use super::data::Data;

/// The identifiable base parameters, in the order of the vector; the scale of torque is fixed by `mass * com`.
pub(super) const BASE: usize = 5;
/// Indices of the motor's gain and of the two dampings.
pub(super) const DRIVE: usize = 2;
pub(super) const ARM_DAMPING: usize = 3;
pub(super) const PENDULUM_DAMPING: usize = 4;
/// Index of the timing nuisance: by how much the samples are late, a fraction of the period.
pub(super) const TIMING: usize = BASE;
/// Where the effects' parameters begin.
pub(super) const FIRST_EFFECT: usize = BASE + 1;
/// The timing nuisance stays within this share of a sample either way.
const MOST_TIMING: f64 = 0.1;
/// By which factor inertias and gain may differ from the data sheet.
const MOST_FACTOR: f64 = 4.0;

/// The rig as given, and what a step in each parameter means.
#[derive(Clone, Debug)]
pub(super) struct Nominal {
    pub(super) params: Params<f64>,
    pub(super) coefficients: Coefficients<f64>,
    /// A natural size of each base parameter: its nominal value, or a guess where that is zero.
    pub(super) scale: [f64; BASE],
    pub(super) period: f64,
    /// Where the longest recording ends, s.
    pub(super) end: f64,
    /// Effects that the rig file already has: part of every hypothesis, their values fixed.
    pub(super) present: Vec<Effect<f64>>,
}

impl Nominal {
    pub(super) fn new(rig: &Rig, data: &Data) -> Self {
        let c = rig.params.coefficients();
        // Damping ratio one per cent: a small friction, for sheets that leave it out.
        let small = 0.02 * (c.weight * c.pendulum).sqrt();
        Self {
            params: rig.params,
            coefficients: c,
            scale: [
                c.arm,
                c.pendulum,
                c.drive,
                c.arm_damping.max(small),
                c.pendulum_damping.max(small),
            ],
            period: data.runs[0].h,
            end: data
                .runs
                .iter()
                .map(|r| r.t0 + r.y.len() as f64 * r.h)
                .fold(0.0, f64::max),
            present: rig.effects.clone(),
        }
    }

    fn base(&self) -> [f64; BASE] {
        let c = &self.coefficients;
        [
            c.arm,
            c.pendulum,
            c.drive,
            c.arm_damping,
            c.pendulum_damping,
        ]
    }
}

/// Whether the effect is a delay, of the command or of the encoders: the same on recorded input and output.
pub(super) fn is_late(spec: &Spec) -> bool {
    spec.acts.touches(Acts::DELAY.and(Acts::SENSOR_DELAY))
}

/// A set of effects to be fitted beside the base parameters.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    pub(super) effects: Vec<&'static Spec>,
}

impl Hypothesis {
    pub(super) fn base() -> Self {
        Self {
            effects: Vec::new(),
        }
    }

    pub(super) fn has(&self, id: &str) -> bool {
        self.effects.iter().any(|e| e.id == id)
    }

    /// Whether the other has the same effects in the same order.
    pub(super) fn is(&self, other: &Self) -> bool {
        let ids = |h: &Self| h.effects.iter().map(|e| e.id).collect::<Vec<_>>();
        ids(self) == ids(other)
    }

    pub(super) fn with(&self, spec: &'static Spec) -> Self {
        let mut effects = self.effects.clone();
        effects.push(spec);
        Self { effects }
    }

    pub(super) fn without(&self, id: &str) -> Self {
        Self {
            effects: self
                .effects
                .iter()
                .copied()
                .filter(|e| e.id != id)
                .collect(),
        }
    }

    /// Whether a delay is among the effects: then the timing nuisance, which is a delay as well, rests at zero.
    pub(super) fn delays(&self) -> bool {
        self.effects.iter().any(|e| is_late(e))
    }

    /// Those, with their values.
    pub(super) fn local(&self, z: &[f64], nominal: &Nominal) -> impl Iterator<Item = Effect<f64>> {
        let values = self.physical(z, nominal);
        self.effects
            .iter()
            .enumerate()
            .filter(|(_, e)| e.acts.includes(Acts::JUMPS))
            .filter_map(move |(i, e)| {
                let first = self.offset(i);
                Effect::unchecked(e.id, &values[first..first + e.parameters.len()])
            })
    }

    /// Whether something about the start of a window is only inferred from the motion before: how the rotor stands, how bristles are bent.
    pub(super) fn infers(&self) -> bool {
        let inferred = Acts::DRIVE.and(Acts::MEMORY);
        self.effects.iter().any(|e| e.acts.touches(inferred))
    }

    /// Whether there is play in the drive.
    pub(super) fn has_play(&self) -> bool {
        self.has("drive.backlash")
    }

    /// Length of the parameter vector.
    pub(super) fn len(&self) -> usize {
        FIRST_EFFECT
            + self
                .effects
                .iter()
                .map(|e| e.parameters.len())
                .sum::<usize>()
    }

    /// How many of them are free.
    pub(super) fn free(&self) -> usize {
        let fixed = self
            .effects
            .iter()
            .flat_map(|e| e.parameters)
            .filter(|p| !p.kind.is_continuous())
            .count();
        self.len() - usize::from(self.delays()) - fixed
    }

    /// Whether one of the effects is local in time, as a kick is.
    pub(super) fn jumps(&self) -> bool {
        self.effects.iter().any(|e| e.acts.includes(Acts::JUMPS))
    }

    /// Where the parameters of the `index`-th effect begin.
    pub(super) fn offset(&self, index: usize) -> usize {
        FIRST_EFFECT
            + self.effects[..index]
                .iter()
                .map(|e| e.parameters.len())
                .sum::<usize>()
    }

    /// Physical size of one unit of each component of the vector.
    pub(super) fn scales(&self, nominal: &Nominal) -> Vec<f64> {
        let mut scales = nominal.scale.to_vec();
        scales.push(nominal.period);
        for e in &self.effects {
            scales.extend(e.parameters.iter().map(|p| (p.typical)(&nominal.params)));
        }
        scales
    }

    /// Where each component of the vector is zero: data sheet, and effects that do nothing.
    fn origins(&self, nominal: &Nominal) -> Vec<f64> {
        let mut origins = nominal.base().to_vec();
        origins.push(0.0);
        let parameters = self.effects.iter().flat_map(|e| e.parameters);
        origins.extend(parameters.map(|p| p.off));
        origins
    }

    /// The values in physical units (base parameters: the coefficients themselves).
    pub(super) fn physical(&self, z: &[f64], nominal: &Nominal) -> Vec<f64> {
        let mut values: Vec<f64> = z
            .iter()
            .zip(self.scales(nominal))
            .map(|(z, s)| z * s)
            .collect();
        for (v, b) in values.iter_mut().zip(self.origins(nominal)) {
            *v += b;
        }
        values
    }

    /// Where each component may lie: positive inertias and gains within a factor of the data sheet's, friction that does not drive,
    /// effects within their ranges; whole numbers and choices stay as they are.
    pub(super) fn bounds(&self, nominal: &Nominal, z: &[f64]) -> Vec<(f64, f64)> {
        let (base, scale) = (nominal.base(), nominal.scale);
        let mut bounds: Vec<(f64, f64)> = (0..BASE)
            .map(|i| {
                let (least, most) = if i < 3 {
                    (base[i] / MOST_FACTOR, base[i] * MOST_FACTOR)
                } else {
                    (0.0, base[i] + 20.0 * scale[i])
                };
                ((least - base[i]) / scale[i], (most - base[i]) / scale[i])
            })
            .collect();
        bounds.push(if self.delays() {
            (0.0, 0.0)
        } else {
            (-MOST_TIMING, MOST_TIMING)
        });
        let parameters = self
            .effects
            .iter()
            .flat_map(|e| e.parameters.iter().enumerate().map(move |(k, p)| (e, k, p)));
        bounds.extend(parameters.zip(&z[FIRST_EFFECT..]).map(|((e, k, p), z)| {
            if !p.kind.is_continuous() {
                return (*z, *z);
            }
            let scale = (p.typical)(&nominal.params);
            if p.kind == Kind::Time {
                return (0.0, (nominal.end - p.off) / scale);
            }
            // A push shorter than a sample is none.
            let lasts = e.acts.includes(Acts::JUMPS) && k >= e.strengths;
            let least = if lasts {
                p.min.max(nominal.period)
            } else {
                p.min
            };
            ((least - p.off) / scale, (p.max - p.off) / scale)
        }));
        bounds
    }

    /// The plant for the vector, and the time by which everything is late (s). With `N > 0`, component `i` of the vector is
    /// independent variable `offset + i`.
    pub(super) fn plant<const N: usize>(
        &self,
        z: &[f64],
        nominal: &Nominal,
        offset: usize,
    ) -> (Plant<Jet<f64, N>>, Jet<f64, N>) {
        let (scales, origins) = (self.scales(nominal), self.origins(nominal));
        let variable = |i: usize| {
            let mut x = Jet::<f64, N>::constant(origins[i] + z[i] * scales[i]);
            if offset + i < N {
                x.d[offset + i] = scales[i];
            }
            x
        };
        let c = nominal.coefficients;
        let pendulum = variable(1);
        let arm = variable(0);
        let coefficients = Coefficients {
            arm,
            // The pendulum's share of the arm's inertia is that of the data sheet.
            hub: arm - Jet::constant(c.arm - c.hub),
            pendulum,
            // m c² is in both: a longer pendulum swings with more inertia about both axes.
            swing: Jet::constant(c.swing) + pendulum - Jet::constant(c.pendulum),
            drive: variable(2),
            arm_damping: variable(3),
            pendulum_damping: variable(4),
            coupling: Jet::constant(c.coupling),
            weight: Jet::constant(c.weight),
            lever: Jet::constant(c.lever),
        };
        let mut late = if self.delays() {
            Jet::constant(0.0)
        } else {
            variable(TIMING)
        };
        let mut effects = Vec::new();
        for e in &nominal.present {
            let e: Effect<Jet<f64, N>> = e.cast();
            if is_late(e.spec()) {
                late += e.values()[0];
            } else {
                effects.push(e);
            }
        }
        let mut i = FIRST_EFFECT;
        for spec in &self.effects {
            let values: arrayvec::ArrayVec<Jet<f64, N>, MAX_PARAMETERS> =
                (0..spec.parameters.len())
                    .map(|k| variable(i + k))
                    .collect();
            i += spec.parameters.len();
            if is_late(spec) {
                late += values[0];
            } else if let Some(e) = Effect::unchecked(spec.id, &values) {
                effects.push(e);
            }
        }
        let plant = Plant::from_coefficients(coefficients, &effects)
            .or_else(|_| Plant::from_coefficients(coefficients, &[]));
        match plant {
            Ok(plant) => (plant, late),
            Err(_) => unreachable!("no effects are not too many"),
        }
    }
}
