//! NumPy arrays in and out.

use numpy::ndarray::ArrayD;
use numpy::{
    IntoPyArray, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use portolan::Answer;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::dimension::Either;
use crate::fault::{value_error, work};

/// Numbers as `f64` in C order: in place where they are so already, else a copy.
pub(crate) struct Numbers<'py> {
    array: PyReadonlyArrayDyn<'py, f64>,
    name: &'static str,
}

/// The array of an argument, whatever its type; complex numbers, objects, strings, booleans and masked values are refused.
pub(crate) fn checked<'py>(given: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    let array = some_array(given, name)?;
    if !matches!(array.dtype().kind(), b'f' | b'i' | b'u') {
        return Err(value_error(format!(
            "{name}: numbers are wanted, got an array of dtype {}",
            array.dtype()
        )));
    }
    without_mask(array, name)
}

/// What is given as an array.
fn some_array<'py>(given: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    if let Ok(array) = given.cast::<PyUntypedArray>() {
        return Ok(array.clone());
    }
    let array = given.py().import("numpy")?.call_method1("asarray", (given,));
    let array = array.map_err(|error| value_error(format!("{name}: not an array of numbers: {error}")))?;
    Ok(array.cast_into::<PyUntypedArray>()?)
}

/// Refuses masked values.
fn without_mask<'py>(array: Bound<'py, PyUntypedArray>, name: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    // Ordinary arrays have no mask; asking the class costs less than asking the instance.
    if array.is_exact_instance_of::<PyUntypedArray>() {
        return Ok(array);
    }
    let masked = array.py().import("numpy")?.getattr("ma")?;
    if array.is_instance(&masked.getattr("MaskedArray")?)? {
        let mask: usize = masked.call_method1("count_masked", (&array,))?.extract()?;
        if mask > 0 {
            return Err(value_error(format!(
                "{name}: {mask} of {} values are masked; fill them or leave them out",
                array.len()
            )));
        }
    }
    Ok(array)
}

/// An array of booleans or numbers in C or in Fortran order, in the machine's order of bytes: the one that is given, if it
/// is such a one.
pub(crate) fn dense<'py>(given: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    let array = some_array(given, name)?;
    let dtype = array.dtype();
    if !matches!(dtype.kind(), b'b' | b'f' | b'i' | b'u') {
        return Err(value_error(format!(
            "{name}: booleans or numbers are wanted, got an array of dtype {dtype}"
        )));
    }
    let native = dtype.is_native_byteorder() != Some(false);
    if native && array.is_contiguous() && array.is_exact_instance_of::<PyUntypedArray>() {
        return Ok(array);
    }
    let array = without_mask(array, name)?;
    let options = PyDict::new(array.py());
    options.set_item("dtype", dtype.call_method1("newbyteorder", ("=",))?)?;
    let numpy = array.py().import("numpy")?;
    // What is contiguous already is not copied, whatever its class.
    let how = if array.is_fortran_contiguous() { "asfortranarray" } else { "ascontiguousarray" };
    Ok(numpy.call_method(how, (array,), Some(&options))?.cast_into()?)
}

/// The same array with this type of numbers, in C order.
pub(crate) fn converted<'py, T: numpy::Element>(
    array: &Bound<'py, PyUntypedArray>,
    dtype: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    if array.is_c_contiguous()
        && let Ok(array) = array.cast::<PyArrayDyn<T>>()
        // A subclass may be of other strides than it says, or of another byte order.
        && array.is_exact_instance_of::<PyArrayDyn<T>>()
    {
        return Ok(array.try_readonly()?);
    }
    let options = PyDict::new(array.py());
    options.set_item("dtype", dtype)?;
    let copy = array.py().import("numpy")?.call_method("ascontiguousarray", (array,), Some(&options))?;
    Ok(copy.cast_into::<PyArrayDyn<T>>()?.try_readonly()?)
}

impl<'py> Numbers<'py> {
    pub(crate) fn of(given: &Bound<'py, PyAny>, name: &'static str) -> PyResult<Self> {
        let array = checked(given, name)?;
        Ok(Self { array: converted(&array, "f8")?, name })
    }

    pub(crate) fn shape(&self) -> &[usize] {
        self.array.shape()
    }

    pub(crate) fn values(&self) -> PyResult<&[f64]> {
        Ok(self.array.as_slice()?)
    }

    /// One row of `n` numbers.
    pub(crate) fn exactly<const N: usize>(&self) -> PyResult<[f64; N]> {
        match (self.shape(), <[f64; N]>::try_from(self.values()?)) {
            ([_], Ok(numbers)) => Ok(numbers),
            (shape, _) => Err(self.wrong(shape, &format!("{N} numbers"))),
        }
    }

    /// The refusal of a shape.
    pub(crate) fn wrong(&self, shape: &[usize], wanted: &str) -> PyErr {
        value_error(format!(
            "{}: an array of shape {} was given; {wanted} are wanted",
            self.name,
            shown(shape)
        ))
    }
}

/// A shape as NumPy prints it.
pub(crate) fn shown(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

/// Points of either dimension.
pub(crate) type Chunks<'a> = Either<&'a [[f64; 2]], &'a [[f64; 3]]>;

/// Points: an array of shape `(..., D)`.
pub(crate) struct Points<'py>(Numbers<'py>);

impl<'py> Points<'py> {
    /// Points of one of the dimensions.
    pub(crate) fn of(given: &Bound<'py, PyAny>, name: &'static str) -> PyResult<Self> {
        let numbers = Numbers::of(given, name)?;
        match numbers.shape().last() {
            Some(2 | 3) => Ok(Self(numbers)),
            _ => Err(numbers.wrong(numbers.shape(), "points of shape (..., 2) or (..., 3)")),
        }
    }

    /// Points of the dimension of a map.
    pub(crate) fn in_dimension(given: &Bound<'py, PyAny>, name: &'static str, d: usize) -> PyResult<Self> {
        let numbers = Numbers::of(given, name)?;
        if numbers.shape().last() == Some(&d) {
            return Ok(Self(numbers));
        }
        Err(numbers.wrong(numbers.shape(), &format!("points of shape (..., {d}), as the map is {d}-D,")))
    }

    /// In 2-D or in 3-D.
    pub(crate) fn chunks(&self) -> PyResult<Chunks<'_>> {
        let values = self.0.values()?;
        Ok(match self.0.shape().last() {
            Some(2) => Either::Two(values.as_chunks().0),
            _ => Either::Three(values.as_chunks().0),
        })
    }

    /// The shape without its last axis.
    pub(crate) fn leading(&self) -> &[usize] {
        let shape = self.0.shape();
        &shape[..shape.len().saturating_sub(1)]
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.leading().iter().product()
    }

    pub(crate) fn shape(&self) -> &[usize] {
        self.0.shape()
    }
}

/// Results are looked at for an interrupt after so many points.
const AT_ONCE: usize = 1 << 18;
/// Fewer points are not shared out.
const SHARED: usize = 1 << 11;

/// `f` of every point, on all cores, with the interpreter released; Ctrl-C ends it.
pub(crate) fn each<P: Sync, T: Send>(
    py: Python<'_>,
    points: &[P],
    f: impl Fn(&P) -> T + Sync + Send,
) -> PyResult<Vec<T>> {
    let mut results = Vec::with_capacity(points.len());
    for chunk in points.chunks(AT_ONCE) {
        work(py, || {
            if chunk.len() < SHARED {
                results.extend(chunk.iter().map(&f));
            } else {
                results.par_extend(chunk.par_iter().map(&f));
            }
        })?;
        py.check_signals()?;
    }
    Ok(results)
}

/// An array that takes the numbers over.
pub(crate) fn array<'py, T: numpy::Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array =
        ArrayD::from_shape_vec(shape, values).map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
    Ok(array.into_pyarray(py))
}

/// An array of rows.
pub(crate) fn rows<'py, T: numpy::Element, const N: usize>(
    py: Python<'py>,
    values: Vec<[T; N]>,
    leading: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    array(py, values.into_flattened(), &[leading, &[N]].concat())
}

/// Values, NaN where there is none, and statuses.
pub(crate) type Answers<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<u8>>);

/// Answers as two arrays.
pub(crate) fn answers<'py>(
    py: Python<'py>,
    all: Vec<Answer<f64>>,
    leading: &[usize],
) -> PyResult<Answers<'py>> {
    let values = all.iter().map(|a| a.value().unwrap_or(f64::NAN)).collect();
    let statuses = all.iter().map(|a| a.status().byte()).collect();
    Ok((array(py, values, leading)?, array(py, statuses, leading)?))
}

/// What a map of either dimension says at each of the points, which are of its dimension.
macro_rules! at_points {
    ($py:expr, $of:expr, $points:expr, |$map:ident, $p:ident| $answer:expr) => {
        match ($of, $points.chunks()?) {
            ($crate::dimension::Either::Two($map), $crate::dimension::Either::Two(all)) => {
                $crate::arrays::each($py, all, |&$p| $answer)?
            }
            ($crate::dimension::Either::Three($map), $crate::dimension::Either::Three(all)) => {
                $crate::arrays::each($py, all, |&$p| $answer)?
            }
            _ => return Err($crate::fault::value_error("points and map are of different dimensions")),
        }
    };
}
pub(crate) use at_points;
