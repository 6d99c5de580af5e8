//! Mistakes in models and what the compiler says about them: one mistake per file, named after its message.
//! A folder holds the cases of one section of the macro's catalogue of messages.
//!
//! Run one folder with `cargo test -p dynamics-ui-tests names`, and one case with
//! `cargo test -p dynamics-ui-tests names -- trybuild=unknown_name`.
//! `TRYBUILD=overwrite cargo test -p dynamics-ui-tests` writes the messages anew. Read them before you commit
//! them.

/// A test for each folder. `trybuild` compiles all cases of a folder at once.
macro_rules! folders {
    ($($folder:ident)*) => {
        $(
            #[test]
            fn $folder() {
                let cases = trybuild::TestCases::new();
                cases.compile_fail(concat!(stringify!($folder), "/*.rs"));
            }
        )*

        #[test]
        fn every_folder_has_a_test() {
            let named = [$(stringify!($folder)),*];
            let entries = std::fs::read_dir(env!("CARGO_MANIFEST_DIR")).expect("a readable folder");
            for path in entries.map(|entry| entry.expect("a readable entry").path()) {
                let name = path.file_name().expect("an entry has a name").to_string_lossy().into_owned();
                assert!(!path.is_dir() || named.contains(&name.as_str()), "no test compiles `{name}/`");
            }
        }
    };
}

// In the order in which the macro works: it reads the block, it follows the functions, and it checks the
// equations. The last two folders hold models with several mistakes, and errors that rustc finds.
folders! {
    structs roles families
    names shapes numbers statements time reactions speeds units
    models constraints
    several rustc
}
