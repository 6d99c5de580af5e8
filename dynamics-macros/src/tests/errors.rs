//! One mistake, one error, at the right tokens.
