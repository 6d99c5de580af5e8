//! Every word of the language, in models of every size.

mod constraints;
mod large;
mod speeds;
mod vocabulary;
