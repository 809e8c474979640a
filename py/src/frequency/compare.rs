//! What a measured transfer function knows that a rig file does not.

use super::frf::PyFrf;
use super::transfer_fit::PyTransferFit;
use crate::arguments::{RigLike, kind};
use crate::background::awaited;
use crate::error;
use crate::file;
use crate::kept::{Kept, kept};
use crate::matrix::{Vector, vector};
use furuta_ident::frequency::compare::{self as engine, Comparison, Explanation, Measured};
use furuta_ident::frequency::first_principles::Output;
use furuta_ident::frequency::{Hold, Transfer, fong2014};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;

/// What `compare` found.
///
/// Attributes
/// ----------
/// as_given_error : float
///     RMS relative error of the rig as its file has it.
/// explanations : list of dict
///     Best first: effects (list of ids, empty for refitted parameters alone), values (by "id parameter": value, std),
///     refitted (factor on the data sheet's value by name: factor, std), relative_error, parameters, bic, evidence
///     (fall of BIC against the parameters alone), same_as (sets that the response cannot tell from this one), response
///     (complex array at `frequency`). Deviations that are not known are inf.
/// frequency, measured : numpy.ndarray
#[pyclass(name = "Comparison", module = "furuta", frozen)]
pub(crate) struct PyComparison {
    found: Comparison,
    measured: Measured,
    rig: String,
}

#[pymethods]
impl PyComparison {
    #[getter]
    fn as_given_error(&self) -> f64 {
        self.found.as_given_error
    }

    #[getter]
    fn frequency<'py>(&self, py: Python<'py>) -> Bound<'py, numpy::PyArray1<f64>> {
        self.measured.frf.frequency.clone().into_pyarray(py)
    }

    #[getter]
    fn measured<'py>(
        &self,
        py: Python<'py>,
    ) -> Bound<'py, numpy::PyArray1<nalgebra::Complex<f64>>> {
        self.measured.frf.response.clone().into_pyarray(py)
    }

    #[getter]
    fn explanations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let all = PyList::empty(py);
        for e in &self.found.explanations {
            all.append(as_dict(py, e)?)?;
        }
        Ok(all)
    }

    /// The ranking in words, and what a response cannot tell apart.
    fn summary(&self) -> String {
        engine::text(&self.rig, &self.what(), None, &self.measured, &self.found)
    }

    /// Writes a report, one HTML page that needs no network: the Bode plot of what was measured, the rig as given, its
    /// parameters refitted and the best explanation; the ranking. A file that is there and no such page is replaced
    /// only with `force`.
    #[pyo3(signature = (path, *, force=false))]
    fn report(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        let what = self.what();
        let bode = engine::plot(&self.rig, &what, &self.measured, &self.found)
            .map_err(error::identification)?;
        let title = format!("What {what} of {} has and its file has not", self.rig);
        file::write_page(py, &path, force, || {
            furuta_ident::report::frequency(&title, bode, &self.summary(), &[])
        })
    }

    fn __repr__(&self) -> String {
        let best = self.found.explanations.first();
        format!(
            "<furuta.Comparison {}>",
            best.map_or_else(|| "nothing".to_owned(), Explanation::name)
        )
    }

    fn __str__(&self) -> String {
        self.summary()
    }

    /// The result as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "comparison")
    }

    /// Draws what was measured, and what the best explanations give, with matplotlib.
    ///
    /// Parameters
    /// ----------
    /// ax : matplotlib.axes.Axes or two of them, optional
    ///     Magnitude, or magnitude and phase; a figure of their own if not given.
    ///
    /// Returns
    /// -------
    /// matplotlib.figure.Figure
    #[pyo3(signature = (*, ax=None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py()
            .import("furuta.plot._comparison")?
            .call_method1("plot", (slf, ax))
    }
}

kept!(PyComparison);

impl Kept for PyComparison {
    fn content(&self) -> String {
        format!("{:?} {:?} {}", self.found, self.measured, self.rig)
    }
}

impl PyComparison {
    fn what(&self) -> String {
        format!("{} / u", self.measured.output.name())
    }
}

fn as_dict<'py>(py: Python<'py>, e: &Explanation) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("effects", &e.effects)?;
    let values = PyDict::new(py);
    for v in &e.values {
        let value = PyDict::new(py);
        value.set_item("value", v.value)?;
        value.set_item("std", v.std)?;
        value.set_item("unit", v.unit)?;
        values.set_item(format!("{} {}", v.effect, v.parameter), value)?;
    }
    out.set_item("values", values)?;
    let refitted = PyDict::new(py);
    for r in &e.refitted {
        let value = PyDict::new(py);
        value.set_item("factor", r.factor)?;
        value.set_item("std", r.std)?;
        refitted.set_item(r.name, value)?;
    }
    out.set_item("refitted", refitted)?;
    out.set_item("relative_error", e.relative_error)?;
    out.set_item("parameters", e.parameters)?;
    out.set_item("bic", e.bic)?;
    out.set_item("evidence", e.evidence)?;
    out.set_item("same_as", &e.same_as)?;
    out.set_item("response", e.response.clone().into_pyarray(py))?;
    Ok(out)
}

/// Which effects of the catalogue explain what a measured transfer function has and a rig file has not.
///
/// Parameters
/// ----------
/// measured : Frf, TransferFit, (num, den), control.TransferFunction or "fong2014"
///     A response; coefficients by falling power of s; or the published fit (29) of Fong et al. 2014.
/// rig : Rig
/// output : {"alpha", "theta"}, optional
/// band : (float, float), optional
///     Where coefficients are compared, Hz.
///
/// Returns
/// -------
/// Comparison
///
/// Raises
/// ------
/// IdentificationError
///     A response or function that cannot be compared.
///
/// Examples
/// --------
/// >>> import furuta
/// >>> found = furuta.compare("fong2014", furuta.Rig.load("fong2014-emecs"))
/// >>> next(e for e in found.explanations if len(e["effects"]) == 1)["effects"]
/// ['arm.spring']
#[pyfunction]
#[pyo3(signature = (measured, rig, *, output="alpha", band=(0.1, 23.0)), text_signature = "(measured, rig, \
    *, output=\"alpha\", band=(0.1, 23.0))")]
pub(crate) fn compare(
    py: Python<'_>,
    measured: &Bound<'_, PyAny>,
    rig: RigLike,
    output: &str,
    band: (f64, f64),
) -> PyResult<PyComparison> {
    let output = match output {
        "alpha" => Output::Alpha,
        "theta" => Output::Theta,
        other => {
            return Err(error::identification(format!(
                "output = {other:?} is none of \"alpha\", \"theta\""
            )));
        }
    };
    let function = |g: &Transfer| {
        Measured::function(g, output, [band.0, band.1]).map_err(error::identification)
    };
    let measured = if let Ok(frf) = measured.cast::<PyFrf>() {
        let frf = &frf.get().frf;
        let hold = if frf.sample_period > 0.0 {
            Hold::ZeroOrder(frf.sample_period)
        } else {
            Hold::None
        };
        Measured {
            hold,
            ..Measured::response(frf.clone(), output)
        }
    } else if let Ok(name) = measured.extract::<String>() {
        let published = (name == "fong2014").then(fong2014::published).flatten();
        function(&published.ok_or_else(|| {
            error::identification(format!("{name:?} is no published function: \"fong2014\""))
        })?)?
    } else {
        let (num, den) = coefficients(measured)?;
        function(&Transfer::new(&num, &den).map_err(error::identification)?)?
    };
    let (rig, name) = (rig.rig.clone(), rig.rig.name);
    let (found, measured) = awaited(py, move || (engine::compare(&measured, &rig), measured))?;
    Ok(PyComparison {
        found: found.map_err(error::identification)?,
        measured,
        rig: name,
    })
}

/// Numerator and denominator, by falling power of s: a pair of arrays, a `TransferFit` or python-control's
/// `TransferFunction` of one input and one output.
fn coefficients(given: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<f64>)> {
    let wrong = || {
        error::identification(format!(
            "measured must be an Frf, a TransferFit, (num, den), a control.TransferFunction or \"fong2014\"; a {} was \
             given",
            kind(given)
        ))
    };
    let read = |name, c: &Vector<'_>| vector::<f64>(name, c, error::identification);
    if let (Ok(num), Ok(den)) = (given.getattr("num"), given.getattr("den")) {
        return Ok((
            read("numerator", &first(&num)?)?,
            read("denominator", &first(&den)?)?,
        ));
    }
    if let Ok(fit) = given.cast::<PyTransferFit>() {
        let transfer = &fit.get().fit.transfer;
        return Ok((transfer.numerator.clone(), transfer.denominator.clone()));
    }
    let (num, den): (Vector<'_>, Vector<'_>) = given.extract().map_err(|_| wrong())?;
    Ok((read("numerator", &num)?, read("denominator", &den)?))
}

/// Entry [0][0] of nested lists: of the first output and input.
fn first<'py>(of: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    of.get_item(0)?.get_item(0)
}
