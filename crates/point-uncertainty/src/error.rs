/// What is wrong with a description of errors.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A covariance matrix of another size than there are errors.
    #[error("{errors} common errors, but a covariance matrix of {rows} x {columns}: one row and column for each")]
    Size {
        /// Common errors.
        errors: usize,
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
    /// A matrix that is no covariance.
    #[error("the covariance of `{first}` and `{second}` is {value}: {expected}")]
    Covariance {
        /// Name of the error of this row.
        first: String,
        /// Name of the error of this column.
        second: String,
        /// The value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// Two errors of one name.
    #[error("two common errors are called `{0}`: names must differ")]
    DuplicateName(String),
    /// A column that is not there.
    #[error("column {column} of the common errors is asked for, there are {errors}")]
    Column {
        /// The column.
        column: usize,
        /// Common errors.
        errors: usize,
    },
    /// A sensor's shared error that means nothing.
    #[error("{name} is {value}: it must be finite and {expected}")]
    OutOfDomain {
        /// What it is.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
}

pub(crate) type Result<T> = std::result::Result<T, Error>;
