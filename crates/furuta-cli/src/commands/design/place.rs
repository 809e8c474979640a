//! `furuta design place`: a gain for given poles.

use std::f64::consts::PI;
use std::io::Write;

use furuta_ctrl::controllers::StateFeedback;
use furuta_ctrl::design::place;
use furuta_model::Rig;
use furuta_model::discretize::zero_order_hold;
use nalgebra::Complex;
use serde_json::json;

use super::{CommonArgs, gains, law, upright, write_controller};
use crate::failure::Failure;
use crate::print;
use crate::streams;

/// State feedback u = -K x about upright with given poles of the closed loop.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    common: CommonArgs,
    /// Four poles in rad/s with commas between them, complex ones in pairs: -3,-20,-6+2i,-6-2i. With --rate they are
    /// those of the sampled system that decay and turn alike, z = exp(p h).
    #[arg(long, value_name = "P,P,P,P", value_parser = four_poles, allow_hyphen_values = true)]
    poles: [Complex<f64>; 4],
}

fn four_poles(text: &str) -> Result<[Complex<f64>; 4], String> {
    text.split(',')
        .map(|part| pole(part.trim()).ok_or(part))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|part| format!("{part:?} is no pole; write -5 or -6+2i"))?
        .try_into()
        .map_err(|poles: Vec<_>| format!("four poles are needed, not {}", poles.len()))
}

/// `-5`, `-6+2i`, `-6-2i`, `2i`.
fn pole(text: &str) -> Option<Complex<f64>> {
    let finite = |text: &str| text.parse().ok().filter(|x: &f64| x.is_finite());
    let Some(front) = text.strip_suffix(['i', 'j']) else {
        return finite(text).map(|re| Complex::new(re, 0.0));
    };
    // The sign between the parts: the last one that is neither the first character nor an exponent's.
    let middle = front
        .char_indices()
        .rev()
        .find(|&(k, c)| k > 0 && (c == '+' || c == '-') && !front[..k].ends_with(['e', 'E']))
        .map_or(0, |(k, _)| k);
    let (re, im) = front.split_at(middle);
    let re = if re.is_empty() { 0.0 } else { finite(re)? };
    let im = match im {
        "" | "+" => 1.0,
        "-" => -1.0,
        im => finite(im)?,
    };
    Some(Complex::new(re, im))
}

/// Refuses poles with which the pendulum falls.
fn stable(poles: &[Complex<f64>; 4]) -> Result<(), Failure> {
    match poles.iter().find(|p| p.re >= 0.0) {
        None => Ok(()),
        Some(pole) => Err(Failure::new(format!(
            "--poles: {} rad/s is not stable: the pendulum would fall; give poles with a real part below 0",
            print::poles(&[Complex::new(pole.re, pole.im.abs())])
        ))),
    }
}

/// Refuses poles that turn by more than half a turn from one sample to the next: sampled, they are slower ones.
fn told_apart(poles: &[Complex<f64>; 4], rate: f64) -> Result<(), Failure> {
    let fastest = PI * rate;
    match poles.iter().find(|p| p.im.abs() > fastest) {
        None => Ok(()),
        Some(pole) => {
            let upper = Complex::new(pole.re, pole.im.abs());
            let sampled = (upper / rate).exp().ln() * rate;
            Err(Failure::new(format!(
                "--poles: {} rad/s turns by more than half a turn between samples at {rate} Hz, where it is the same \
                 as {} rad/s: give an imaginary part of at most pi/h = {} rad/s, or a --rate above {} Hz",
                print::poles(&[upper]),
                print::poles(&[Complex::new(sampled.re, sampled.im.abs())]),
                print::significant(fastest),
                print::significant(upper.im / PI)
            )))
        }
    }
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.common.rig)?;
    stable(&args.poles)?;
    if let Some(rate) = args.common.rate {
        told_apart(&args.poles, rate)?;
    }
    let linear = upright(&rig)?;
    let (a, b, wanted) = match args.common.rate {
        Some(rate) => {
            let (a, b) = zero_order_hold(&linear.a, &linear.b, 1.0 / rate);
            (a, b, args.poles.map(|p| (p / rate).exp()))
        }
        None => (linear.a, linear.b, args.poles),
    };
    let k = place(&a, &b, &wanted).map_err(|e| Failure::new(format!("rig {}: {e}", rig.name)))?;
    let settings = StateFeedback::<f64>::settings();
    let settings = settings.with("gain", k.as_slice())?;
    let judged = args
        .common
        .judge
        .judge(&rig, law(k.as_slice()), args.common.rate, &settings)?;
    if let Some(path) = &args.common.write_controller {
        write_controller(path, &rig, args.common.rate, settings);
    }
    let mut out = streams::output();
    if args.common.json {
        let mut line = json!({
            "rig": rig.name, "rate": args.common.rate, "wanted": print::poles_json(&wanted), "k": k.as_slice(),
            "poles": print::poles_json(&judged.poles),
        });
        judged.extend(&mut line);
        return Ok(writeln!(out, "{line}")?);
    }
    writeln!(
        out,
        "{}: u = -K [theta, alpha, theta_dot, alpha_dot]",
        rig.name
    )?;
    gains(&mut out, k.as_slice(), &rig)?;
    judged.print(&mut out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poles_as_people_write_them() {
        let expected = [(-5.0, 0.0), (-6.0, 2.0), (-6.0, -2.0), (-1e-3, 1.0)];
        let read = four_poles("-5, -6+2i, -6-2j, -1e-3+i").expect("sound");
        assert_eq!(read, expected.map(|(re, im)| Complex::new(re, im)));
        assert_eq!(pole("-1e-3-2e-1i"), Some(Complex::new(-1e-3, -0.2)));
        assert_eq!(pole("-3i"), Some(Complex::new(0.0, -3.0)));
        for wrong in ["", "x", "-3+xi", "nan", "inf+2i", "1+2"] {
            assert_eq!(pole(wrong), None, "{wrong}");
        }
        assert!(four_poles("-1,-2,-3").is_err());
    }
}
