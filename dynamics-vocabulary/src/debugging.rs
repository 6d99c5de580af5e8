//! The `Debug` output of errors.

/// `Debug` of an error is its sentence: that is what `main` and `unwrap` print.
#[doc(hidden)]
#[macro_export]
macro_rules! sentence_for_debugging {
    ($error:ident $(<$model:ident: $bound:path>)?) => {
        impl $(<$model: $bound>)? core::fmt::Debug for $error $(<$model>)? {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                core::fmt::Display::fmt(self, f)
            }
        }
    };
}
