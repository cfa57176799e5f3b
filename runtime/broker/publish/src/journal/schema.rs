//! Creation of the journal's database, and migration from earlier schemas.

use std::path::Path;

use rusqlite::Connection;

use super::error::classify;
use super::{JournalError, SCHEMA_VERSION};

const SCHEMA: &str = include_str!("journal.sql");

/// Capacity of the cache for prepared statements. It is as large as the number of statements for entries.
const STATEMENTS: usize = 24;

/// Creates the schema in a database, or migrates an earlier schema to the current one.
pub(super) fn prepare(connection: &Connection, path: &Path) -> Result<(), JournalError> {
    let fail = |source| classify(path, source);
    let found: i64 = connection
        .query_row("PRAGMA user_version", [], |row| row.get(0))
        .map_err(fail)?;
    if found > SCHEMA_VERSION {
        return Err(JournalError::Newer {
            path: path.to_path_buf(),
            found,
        });
    }
    if found == 1 || found == 2 {
        // The old column contains no required set, so every verdict is examined again.
        let newer = "BEGIN; ALTER TABLE files RENAME COLUMN bundles TO jury; \
                     ALTER TABLE files ADD COLUMN epoch INTEGER NOT NULL DEFAULT 0; \
                     ALTER TABLE files ADD COLUMN written TEXT NOT NULL DEFAULT ''; \
                     ALTER TABLE deliveries RENAME TO deliveries_before; \
                     CREATE TABLE deliveries (path TEXT NOT NULL, reporter TEXT NOT NULL, \
                     job INTEGER, PRIMARY KEY (path, reporter)) WITHOUT ROWID; \
                     INSERT INTO deliveries SELECT path, reporter, nullif(job, 0) \
                     FROM deliveries_before; DROP TABLE deliveries_before; \
                     PRAGMA user_version = 3; COMMIT;";
        connection.execute_batch(newer).map_err(fail)?;
    }
    if (1..=3).contains(&found) {
        // The skipped checkers stay in this table as they are, row by row.
        connection
            .execute_batch("BEGIN; ALTER TABLE job_checkers RENAME TO job_findings; PRAGMA user_version = 4; COMMIT;")
            .map_err(fail)?;
    }
    if (1..=4).contains(&found) {
        // The dependencies of older verdicts are unknown, so the files are judged again.
        let newer = "BEGIN; ALTER TABLE files ADD COLUMN own TEXT NOT NULL DEFAULT ''; \
                     ALTER TABLE files ADD COLUMN own_errors INTEGER NOT NULL DEFAULT 0; \
                     ALTER TABLE files ADD COLUMN rests_on TEXT NOT NULL DEFAULT ''; \
                     PRAGMA user_version = 5; COMMIT;";
        connection.execute_batch(newer).map_err(fail)?;
    }
    if (1..=5).contains(&found) {
        connection
            .execute_batch(
                "BEGIN; ALTER TABLE files RENAME COLUMN jury TO required_set; PRAGMA user_version = 6; COMMIT;",
            )
            .map_err(fail)?;
    }
    connection.set_prepared_statement_cache_capacity(STATEMENTS);
    // WAL with synchronous=NORMAL survives a killed process. After a power failure the last
    // verdicts may be missing, and their files are judged again.
    connection
        .execute_batch(&format!(
            "PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL; PRAGMA foreign_keys = ON; \
             {SCHEMA} PRAGMA user_version = {SCHEMA_VERSION};"
        ))
        .map_err(fail)
}
