//! A model to be fitted: which effects it has, and how a plain vector of numbers becomes a plant.

use core::ops::Range;
use std::sync::Arc;

use furuta_model::effects::{Acts, Kind, Law, MAX_PARAMETERS};
use furuta_model::params::Coefficients;
use furuta_model::{Actuation, Effect, Jet, Params, Plant, Rig, Scalar, Sensors, Spec};

use crate::pendulum::Pendulum;
use crate::shooting::{
    Data, Late, Layout, Model, Observed, Pass, Prior, ZEROS, is_late, zero_bounds, zero_priors,
    zero_units, zeros_each,
};

/// The identifiable base parameters, in the order of the vector; the scale of torque is fixed by `mass * com`.
pub(super) const BASE: usize = 6;
/// Indices of the arm's and the pendulum's inertia, the motor's gain, of the two dampings and of the arm's length.
pub(super) const ARM_INERTIA: usize = 0;
pub(super) const INERTIA: usize = 1;
pub(super) const DRIVE: usize = 2;
pub(super) const ARM_DAMPING: usize = 3;
pub(super) const PENDULUM_DAMPING: usize = 4;
pub(super) const LENGTH: usize = 5;
/// Index of the timing nuisance: by how much the samples are late, a fraction of the period.
pub(super) const TIMING: usize = BASE;
/// Where the effects' parameters begin.
pub(super) const FIRST_EFFECT: usize = BASE + 1;
/// The timing nuisance stays within this share of a sample either way.
const MOST_TIMING: f64 = 0.1;
/// By which factor inertias and gain may differ from the data sheet.
const MOST_FACTOR: f64 = 4.0;
/// By how many of its standard deviations the arm's length may.
pub(super) const MOST_DEVIATIONS: f64 = 3.0;

/// The rig as given, and what a step in each parameter means.
#[derive(Clone, Debug)]
pub(super) struct Sheet {
    pub(super) params: Params<f64>,
    sensors: Sensors,
    pub(super) coefficients: Coefficients<f64>,
    /// Of the arm's inertia, what goes with the square of its length.
    carried: f64,
    /// Whether the pendulum swings on a moving arm.
    is_coupled: bool,
    /// Base parameters that data cannot show beside the others: they stay what the sheet says.
    pub(super) held: [bool; BASE],
    /// Whether each of the angles tells of the model.
    pub(super) tells: [bool; 2],
    /// A natural size of each base parameter: the sheet's value, or a guess where that is zero.
    pub(super) scale: [f64; BASE],
    /// One standard deviation of each base parameter beforehand, by the sheet's tolerances, in units of the vector.
    known: [Option<f64>; BASE],
    pub(super) period: f64,
    /// Where the longest recording ends, s.
    pub(super) end: f64,
    /// How many recordings there are.
    pub(super) recordings: usize,
    /// Whether each recording has zeros of its own.
    pub(super) own_zeros: bool,
    /// The recording from whose zero of theta angles of rest are counted; none of recordings that the fit has not seen,
    /// and none where an effect of the rig file says at which angle it acts: all are counted from the rig's zero then.
    pub(super) reference: Option<usize>,
    /// Effects that the rig file already has: part of every hypothesis, their values fixed.
    pub(super) present: Vec<Effect<f64>>,
    /// The entries that a search looks for.
    pub(super) looked_for: Vec<&'static Spec>,
}

impl Sheet {
    pub(super) fn new(rig: &Rig, data: &Data, own_zeros: bool, pendulum: Pendulum) -> Self {
        let of_rig = rig.params.coefficients();
        // Damping ratio one per cent: a small friction, for sheets that leave it out.
        let small = 0.02 * (of_rig.weight * of_rig.pendulum).sqrt();
        let c = pendulum.coefficients(of_rig);
        let base = base(&c, rig.params.arm.length);
        let mut scale = base;
        for i in [ARM_DAMPING, PENDULUM_DAMPING] {
            scale[i] = scale[i].max(small);
        }
        let tells = pendulum.tells();
        let moved = moved(&rig.params, tells);
        let shown = |i: usize| match pendulum {
            Pendulum::Swings => moved[0] || !matches!(i, ARM_INERTIA | ARM_DAMPING),
            Pendulum::Removed | Pendulum::Locked => i == DRIVE || (moved[0] && i == ARM_DAMPING),
            Pendulum::Alone => matches!(i, INERTIA | PENDULUM_DAMPING),
            Pendulum::Driven => matches!(i, INERTIA | PENDULUM_DAMPING | LENGTH),
        };
        let present: Vec<Effect<f64>> = (rig.effects.iter().copied())
            .filter(|e| pendulum.has(e.spec()))
            .collect();
        let sees_angle = present.iter().any(|e| e.spec().sees_angle());
        let carried = rig.params.pendulum.mass * rig.params.arm.length.powi(2);
        Self {
            params: rig.params,
            sensors: rig.sensors,
            coefficients: c,
            carried: if pendulum.is_whole() { carried } else { 0.0 },
            is_coupled: pendulum.is_coupled(),
            held: std::array::from_fn(|i| !shown(i)),
            tells,
            scale,
            known: known(rig, &base, &scale),
            period: data.runs.first().map_or(0.0, |r| r.h),
            end: data
                .runs
                .iter()
                .map(|r| r.t0 + r.y.len() as f64 * r.h)
                .fold(0.0, f64::max),
            recordings: data.recordings,
            own_zeros,
            reference: (!sees_angle).then_some(0),
            present,
            looked_for: Vec::new(),
        }
    }

    /// The same rig with recordings that the fit has not seen.
    pub(super) fn for_others(&self, data: &Data) -> Self {
        Self {
            recordings: data.recordings,
            reference: None,
            ..self.clone()
        }
    }

    /// Whether the recordings' own zeros follow an effect as well.
    pub(super) fn zeros_follow(&self, spec: &Spec) -> bool {
        self.own_zeros && spec.acts.includes(Acts::ZERO)
    }

    /// Whether a torque moves each axis.
    pub(super) fn moved(&self) -> [bool; 2] {
        moved(&self.params, self.tells)
    }

    fn base(&self) -> [f64; BASE] {
        base(&self.coefficients, self.params.arm.length)
    }
}

/// Whether a torque moves each axis: none moves one that is held or not there, nor an arm that follows a commanded
/// acceleration.
fn moved(params: &Params<f64>, tells: [bool; 2]) -> [bool; 2] {
    let follows = params.motor.actuation == Actuation::Acceleration;
    [tells[0] && !follows, tells[1]]
}

/// The base parameters of a sheet.
fn base(c: &Coefficients<f64>, length: f64) -> [f64; BASE] {
    [
        c.arm,
        c.pendulum,
        c.drive,
        c.arm_damping,
        c.pendulum_damping,
        length,
    ]
}

/// The `i`-th base parameter as recordings see it: inertias, gain and dampings in proportion to the weight's moment, a
/// commanded acceleration's gain by itself.
fn seen<S: Scalar>(params: &Params<S>, i: usize) -> S {
    let c = params.coefficients();
    match i {
        LENGTH => params.arm.length,
        DRIVE if params.motor.actuation == Actuation::Acceleration => c.drive / c.arm,
        DRIVE => c.drive / c.weight,
        ARM_DAMPING => c.arm_damping / c.weight,
        PENDULUM_DAMPING => c.pendulum_damping / c.weight,
        ARM_INERTIA => c.arm / c.weight,
        _ => c.pendulum / c.weight,
    }
}

/// One standard deviation of each base parameter by the sheet's tolerances, in units of `scale`.
fn known(rig: &Rig, base: &[f64; BASE], scale: &[f64; BASE]) -> [Option<f64>; BASE] {
    std::array::from_fn(|i| {
        let share = rig.tolerance.of(&rig.params, |p| seen(p, i))?;
        Some(share * base[i] / scale[i]).filter(|std| std.is_finite())
    })
}

/// A set of effects to be fitted beside the base parameters.
///
/// The vector: base parameters, timing, the parameters of the effects, and for each recording the zeros of its
/// encoders.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    pub(super) effects: Vec<&'static Spec>,
    pub(super) sheet: Arc<Sheet>,
}

impl Hypothesis {
    pub(super) fn base(sheet: &Arc<Sheet>) -> Self {
        Self {
            effects: Vec::new(),
            sheet: Arc::clone(sheet),
        }
    }

    /// The same, with these entries looked for, each once.
    pub(super) fn looking_for(&self, entries: impl Iterator<Item = &'static Spec>) -> Self {
        let mut sheet = Sheet::clone(&self.sheet);
        sheet.looked_for = Vec::new();
        for spec in entries {
            if sheet.looked_for.iter().all(|known| known.id != spec.id) {
                sheet.looked_for.push(spec);
            }
        }
        Self {
            effects: self.effects.clone(),
            sheet: Arc::new(sheet),
        }
    }

    /// The same effects beside the sheet of another.
    pub(super) fn on_sheet_of(&self, other: &Self) -> Self {
        Self {
            effects: self.effects.clone(),
            sheet: Arc::clone(&other.sheet),
        }
    }

    /// The same effects for recordings that the fit has not seen, their zeros where they should be, and the vector for
    /// them: what acts once in a recording acts in none of these.
    pub(super) fn for_others(&self, z: &[f64], data: &Data) -> (Self, Vec<f64>) {
        let other = Self {
            effects: self.effects.clone(),
            sheet: Arc::new(self.sheet.for_others(data)),
        };
        let mut z = z[..self.shared()].to_vec();
        z.resize(other.len(), 0.0);
        for (i, spec) in self.effects.iter().enumerate() {
            for (k, p) in spec.parameters.iter().enumerate() {
                if p.kind == Kind::Run {
                    z[self.offset(i) + k] = data.recordings as f64;
                }
            }
        }
        (other, z)
    }

    pub(super) fn has(&self, id: &str) -> bool {
        self.effects.iter().any(|e| e.id == id)
    }

    pub(super) fn with(&self, spec: &'static Spec) -> Self {
        let mut effects = self.effects.clone();
        effects.push(spec);
        Self {
            effects,
            sheet: Arc::clone(&self.sheet),
        }
    }

    pub(super) fn without(&self, id: &str) -> Self {
        let kept = self.effects.iter().copied().filter(|e| e.id != id);
        Self {
            effects: kept.collect(),
            sheet: Arc::clone(&self.sheet),
        }
    }

    /// A vector of this hypothesis with the parameters of one more effect.
    pub(super) fn extended(&self, z: &[f64], values: &[f64]) -> Vec<f64> {
        let mut z = z.to_vec();
        let at = self.shared();
        z.splice(at..at, values.iter().copied());
        z
    }

    /// A vector of this hypothesis without the parameters of one of its effects.
    pub(super) fn reduced(&self, z: &[f64], id: &str) -> Vec<f64> {
        let mut z = z.to_vec();
        if let Some(i) = self.effects.iter().position(|e| e.id == id) {
            let offset = self.offset(i);
            z.drain(offset..offset + self.effects[i].parameters.len());
        }
        z
    }

    /// The parameters of one of its effects, in their units.
    pub(super) fn values<'a>(&self, z: &'a [f64], id: &str) -> Option<&'a [f64]> {
        let i = self.effects.iter().position(|e| e.id == id)?;
        let offset = self.offset(i);
        Some(&z[offset..offset + self.effects[i].parameters.len()])
    }

    /// Whether a delay is among the effects: then the timing nuisance, which is a delay as well, rests at zero.
    pub(super) fn delays(&self) -> bool {
        self.effects.iter().any(|e| is_late(e))
    }

    /// The effects with their values.
    fn valued(&self, z: &[f64]) -> impl Iterator<Item = Effect<f64>> {
        let values = self.physical(z);
        (self.effects.iter().enumerate()).filter_map(move |(i, e)| {
            let first = self.offset(i);
            Effect::of(e, &values[first..first + e.parameters.len()])
        })
    }

    /// Those that are local in time, with their values.
    pub(super) fn local(&self, z: &[f64]) -> impl Iterator<Item = Effect<f64>> {
        self.valued(z).filter(|e| e.spec().acts_once())
    }

    /// Those whose values contradict their names, and why.
    pub(super) fn contradictions(
        &self,
        z: &[f64],
    ) -> impl Iterator<Item = (&'static Spec, &'static str)> {
        self.valued(z)
            .filter_map(|e| Some((e.spec(), e.contradiction()?)))
    }

    /// Whether a window's start holds what is only computed from the motion before: how a drive is twisted and which
    /// flanks touch, how far bristles are bent, what a cable, a winding or a user's own law remembers.
    pub(super) fn infers(&self) -> bool {
        let inferred = Acts::DRIVE.and(Acts::MEMORY).and(Acts::INNER);
        self.effects.iter().any(|e| e.acts.touches(inferred))
    }

    /// Whether a drive gives way, so that windows take from those before how the rotor stands.
    pub(super) fn has_drive(&self) -> bool {
        let present = self.sheet.present.iter().map(|e| e.spec());
        present
            .chain(self.effects.iter().copied())
            .any(|e| e.acts.includes(Acts::DRIVE))
    }

    /// Whether bodies meet in blows.
    pub(super) fn has_blows(&self) -> bool {
        self.effects.iter().any(|e| e.acts.includes(Acts::BLOWS))
    }

    /// Whether something in the plant depends on the arm's absolute angle: then the zero of each recording's encoder
    /// shows.
    pub(super) fn sees_angle(&self) -> bool {
        let present = self.sheet.present.iter().map(|e| e.spec());
        present
            .chain(self.effects.iter().copied())
            .any(|e| e.sees_angle())
    }

    /// Length of the part of the vector that all recordings share.
    pub(super) fn shared(&self) -> usize {
        self.offset(self.effects.len())
    }

    /// Length of the vector.
    pub(super) fn len(&self) -> usize {
        self.layout().len()
    }

    /// How many of them are free, but for what is known beforehand of a length and of a pendulum's zero.
    pub(super) fn free(&self) -> usize {
        let fixed = self
            .effects
            .iter()
            .flat_map(|e| e.parameters)
            .filter(|p| !p.kind.is_continuous())
            .count();
        let held = self.sheet.held.iter().filter(|held| **held).count();
        self.shared() - held - usize::from(self.delays()) - fixed + self.free_zeros()
    }

    /// How many recordings have a zero of theta of their own that shows.
    pub(super) fn free_zeros(&self) -> usize {
        if self.sheet.own_zeros && self.sees_angle() {
            self.sheet.recordings - usize::from(self.sheet.reference.is_some())
        } else {
            0
        }
    }

    /// Whether one of the effects is a transient (local in time), as a kick is.
    pub(super) fn is_transient(&self) -> bool {
        self.effects.iter().any(|e| e.acts_once())
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
    pub(super) fn scales(&self) -> Vec<f64> {
        let sheet = &self.sheet;
        let mut scales = sheet.scale.to_vec();
        scales.push(sheet.period);
        for e in &self.effects {
            scales.extend(e.parameters.iter().map(|p| p.typical(&sheet.params)));
        }
        scales.extend(zero_units(&self.layout()));
        scales
    }

    /// Where each component of the vector is zero: data sheet, effects that do nothing, the first recording's zeros.
    fn origins(&self) -> Vec<f64> {
        let mut origins = self.sheet.base().to_vec();
        origins.push(0.0);
        let parameters = self.effects.iter().flat_map(|e| e.parameters);
        origins.extend(parameters.map(|p| p.off));
        origins.resize(self.len(), 0.0);
        origins
    }

    /// The values in physical units (base parameters: the coefficients themselves).
    pub(super) fn physical(&self, z: &[f64]) -> Vec<f64> {
        let mut values: Vec<f64> = z.iter().zip(self.scales()).map(|(z, s)| z * s).collect();
        for (v, b) in values.iter_mut().zip(self.origins()) {
            *v += b;
        }
        values
    }

    /// The zeros `[theta, alpha]` of each recording's encoders, rad, against those of the reference.
    pub(super) fn zeros(&self, z: &[f64]) -> Vec<[f64; ZEROS]> {
        let (layout, values) = (self.layout(), self.physical(z));
        let zero = |r: usize, k: usize| match layout.zeros {
            0 => 0.0,
            _ => values[layout.zero(r, k)],
        };
        (0..self.sheet.recordings)
            .map(|r| std::array::from_fn(|k| zero(r, k)))
            .collect()
    }
}

impl Model for Hypothesis {
    fn shape(&self, number: usize) -> Range<usize> {
        let mut first = FIRST_EFFECT;
        for effect in &self.effects {
            let (shape, next) = (first + effect.strengths, first + effect.parameters.len());
            if (first..shape).contains(&number) {
                return shape..next;
            }
            first = next;
        }
        0..0
    }

    fn layout(&self) -> Layout {
        Layout {
            shared: self.shared(),
            lead: FIRST_EFFECT,
            zeros: zeros_each(self.sheet.own_zeros),
            recordings: self.sheet.recordings,
        }
    }

    /// Positive inertias and gains within a factor of the data sheet's, friction that does not drive, effects within
    /// their ranges; whole numbers and choices stay as they are.
    fn bounds(&self, z: &[f64]) -> Vec<(f64, f64)> {
        let sheet = &self.sheet;
        let (base, scale) = (sheet.base(), sheet.scale);
        let mut bounds: Vec<(f64, f64)> = (0..BASE)
            .map(|i| {
                if sheet.held[i] {
                    return (0.0, 0.0);
                }
                let (least, most) = match i {
                    ARM_DAMPING | PENDULUM_DAMPING => (0.0, base[i] + 20.0 * scale[i]),
                    LENGTH => {
                        let most = MOST_DEVIATIONS * sheet.known[i].unwrap_or(0.0) * scale[i];
                        ((base[i] - most).max(base[i] / MOST_FACTOR), base[i] + most)
                    }
                    _ => (base[i] / MOST_FACTOR, base[i] * MOST_FACTOR),
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
            let scale = p.typical(&sheet.params);
            if p.kind == Kind::Time {
                return (0.0, (sheet.end - p.off) / scale);
            }
            // A push shorter than a sample is none.
            let lasts = e.acts_once() && k >= e.strengths;
            let least = if lasts {
                p.min.max(sheet.period)
            } else {
                p.min
            };
            ((least - p.off) / scale, (p.max - p.off) / scale)
        }));
        bounds.extend(zero_bounds(
            &self.layout(),
            self.sees_angle(),
            sheet.reference,
        ));
        bounds
    }

    fn priors(&self) -> Vec<Option<Prior>> {
        let mut priors = vec![None; self.shared()];
        for (prior, known) in priors.iter_mut().zip(self.sheet.known) {
            *prior = known.map(|std| Prior { mean: 0.0, std });
        }
        priors.extend(zero_priors(&self.layout(), &self.sheet.sensors));
        priors
    }

    fn observed<const N: usize>(&self, z: &[f64], pass: Pass) -> Observed<Jet<f64, N>> {
        let (scales, origins) = (self.scales(), self.origins());
        let layout = self.layout();
        let variable = |i: usize| {
            let mut x = Jet::<f64, N>::constant(origins[i] + z[i] * scales[i]);
            if let Some(d) = pass.derivative::<N>(layout.local_of(i)) {
                x.d[d] = scales[i];
            }
            x
        };
        let sheet = &self.sheet;
        let c = sheet.coefficients;
        let (arm, pendulum) = (variable(0), variable(1));
        // Lengths enter by their ratio to the sheet's; what the pendulum's mass adds to the arm goes with the square.
        let longer = variable(LENGTH) / Jet::constant(sheet.params.arm.length);
        let carried = sheet.carried;
        let fixed = c.arm - c.hub - carried;
        let coefficients = Coefficients {
            arm,
            hub: arm - longer * longer * Jet::constant(carried) - Jet::constant(fixed),
            pendulum,
            // m c² is in both: a longer pendulum swings with more inertia about both axes.
            swing: if sheet.is_coupled {
                Jet::constant(c.swing) + pendulum - Jet::constant(c.pendulum)
            } else {
                Jet::constant(c.swing)
            },
            drive: variable(DRIVE),
            arm_damping: variable(ARM_DAMPING),
            pendulum_damping: variable(PENDULUM_DAMPING),
            coupling: longer * Jet::constant(c.coupling),
            weight: Jet::constant(c.weight),
            lever: longer * Jet::constant(c.lever),
        };
        let mut late = Late::by(if self.delays() {
            Jet::constant(0.0)
        } else {
            variable(TIMING)
        });
        let mut effects = Vec::new();
        for e in &sheet.present {
            let e: Effect<Jet<f64, N>> = e.cast();
            if !late.add(&e) {
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
            effects.extend(Effect::of(spec, &values).filter(|e| !late.add(e)));
        }
        let plant =
            Plant::from_coefficients(coefficients, &effects).unwrap_or_else(|_| Plant::unknown());
        let mut seen = Observed::from_true_zeros(plant, late);
        seen.free_zeros(&layout, z, pass);
        seen
    }
}
