//! A transfer function fitted to a response.

use crate::error;
use crate::kept::{Kept, kept};
use crate::matrix::{Vector, vector};
use furuta_ident::frequency::Fit;
use furuta_ident::frequency::fit::Uncertain;
use furuta_ident::frequency::words::fit_text;
use nalgebra::Complex;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;

type Array<'py, T> = Bound<'py, PyArray1<T>>;

/// A transfer function fitted by `fit_transfer_function`. Coefficients by falling power of s, the denominator's first
/// is 1; `num, den = fit` unpacks them for `scipy.signal` and python-control.
///
/// Attributes
/// ----------
/// numerator, denominator, numerator_std, denominator_std : numpy.ndarray
/// delay, delay_std : float
///     In s.
/// poles, zeros, poles_std, zeros_std : numpy.ndarray, complex
///     In rad/s, slow ones first; the deviations of real and imaginary part.
/// chi2 : float
///     1 where nothing but noise is left.
/// aic, bic, relative_error : float
/// stable : bool
/// notices : list of str
#[pyclass(name = "TransferFit", module = "furuta", frozen)]
pub(crate) struct PyTransferFit {
    pub(crate) fit: Fit,
    /// Where the fit stops, if that is before the band's end.
    pub(super) ends: Option<String>,
}

#[pymethods]
impl PyTransferFit {
    #[getter]
    fn numerator<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.fit.transfer.numerator.clone().into_pyarray(py)
    }

    #[getter]
    fn denominator<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.fit.transfer.denominator.clone().into_pyarray(py)
    }

    #[getter]
    fn numerator_std<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.fit.numerator_std.clone().into_pyarray(py)
    }

    #[getter]
    fn denominator_std<'py>(&self, py: Python<'py>) -> Array<'py, f64> {
        self.fit.denominator_std.clone().into_pyarray(py)
    }

    #[getter]
    fn delay(&self) -> f64 {
        self.fit.delay.value
    }

    #[getter]
    fn delay_std(&self) -> f64 {
        self.fit.delay.std
    }

    #[getter]
    fn poles<'py>(&self, py: Python<'py>) -> Array<'py, Complex<f64>> {
        values(py, &self.fit.poles, |r| r.value)
    }

    #[getter]
    fn poles_std<'py>(&self, py: Python<'py>) -> Array<'py, Complex<f64>> {
        values(py, &self.fit.poles, |r| r.std)
    }

    #[getter]
    fn zeros<'py>(&self, py: Python<'py>) -> Array<'py, Complex<f64>> {
        values(py, &self.fit.zeros, |r| r.value)
    }

    #[getter]
    fn zeros_std<'py>(&self, py: Python<'py>) -> Array<'py, Complex<f64>> {
        values(py, &self.fit.zeros, |r| r.std)
    }

    #[getter]
    fn chi2(&self) -> f64 {
        self.fit.chi2
    }

    #[getter]
    fn aic(&self) -> f64 {
        self.fit.aic
    }

    #[getter]
    fn bic(&self) -> f64 {
        self.fit.bic
    }

    #[getter]
    fn relative_error(&self) -> f64 {
        self.fit.relative_error
    }

    #[getter]
    fn stable(&self) -> bool {
        self.fit.is_stable()
    }

    #[getter]
    fn notices(&self) -> Vec<String> {
        let of_fit = self.fit.notices();
        let of_fit = of_fit.iter().map(ToString::to_string);
        self.ends.iter().cloned().chain(of_fit).collect()
    }

    /// The response that the fit predicts at these frequencies (Hz), hold included.
    fn response<'py>(
        &self,
        py: Python<'py>,
        frequency: Vector<'py>,
    ) -> PyResult<Array<'py, Complex<f64>>> {
        let frequency: Vec<f64> = vector("frequency", &frequency, error::identification)?;
        if let Some(k) = frequency.iter().position(|f| !f.is_finite()) {
            return Err(error::identification(format!(
                "frequency[{k}] = {} is not a finite number",
                frequency[k]
            )));
        }
        let response: Vec<_> = frequency.iter().map(|f| self.fit.response(*f)).collect();
        Ok(response.into_pyarray(py))
    }

    /// The function as python-control's TransferFunction, its delay left out.
    fn to_control<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("control")?
            .call_method1("tf", (self.numerator(py), self.denominator(py)))
    }

    /// The function in words: coefficients, poles and zeros with their deviations, how well it fits.
    fn summary(&self) -> String {
        fit_text(&self.fit)
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pair = (self.numerator(py), self.denominator(py));
        Ok(pair.into_pyobject(py)?.try_iter()?.into_any())
    }

    fn __repr__(&self) -> String {
        let [zeros, poles] = self.fit.transfer.orders();
        format!("<furuta.TransferFit {zeros}/{poles}>")
    }

    fn __str__(&self) -> String {
        self.summary()
    }

    /// The result as a table, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        crate::card::card(slf.as_any(), "transfer_fit")
    }
}

kept!(PyTransferFit);

impl Kept for PyTransferFit {
    fn content(&self) -> String {
        format!("{:?} {:?}", self.fit, self.ends)
    }
}

fn values<'py>(
    py: Python<'py>,
    roots: &[Uncertain<Complex<f64>>],
    value: fn(&Uncertain<Complex<f64>>) -> Complex<f64>,
) -> Array<'py, Complex<f64>> {
    roots.iter().map(value).collect::<Vec<_>>().into_pyarray(py)
}
