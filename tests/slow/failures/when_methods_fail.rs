//! Where methods fail: every row of the table in `docs/when-methods-fail.md` is a test here, that the failure
//! happens as it is described there and that the library tells of it. The charts of that page are drawn by
//! these tests and compared with the files; `UPDATE_CHARTS=1` writes them.

mod branches;
mod charts;
mod conservation;
mod growth;
mod hidden;
mod limits;
mod models;
mod page;
mod statics;
mod stiffness;
