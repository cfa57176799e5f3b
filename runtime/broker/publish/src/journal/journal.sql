-- Journal of one qcbus state directory. `sqlite3` can read it safely while the broker runs.
-- A path that is not UTF-8 is stored as `bytes:` and the path with its invalid bytes as %XX.
-- Digests are SHA-256 in hexadecimal, times are milliseconds since 1970 (UTC).

-- One row per file with a verdict. The broker reads it after a restart.
CREATE TABLE IF NOT EXISTS files (
    path     TEXT PRIMARY KEY,      -- absolute
    job      INTEGER NOT NULL,      -- the job that gave the verdict; numbers are never reused (`Settings::numbers`)
    verdict  TEXT NOT NULL,         -- accepted, rejected, undetermined
    digest   TEXT NOT NULL,         -- of the file's bytes
    basis    TEXT NOT NULL,         -- digest of everything that the verdict depends on
    config   TEXT NOT NULL,         -- digest of the configuration
    required_set TEXT NOT NULL,     -- JSON list of [bundle, version digest]; null: the bundle was missing
    errors   INTEGER NOT NULL,
    warnings INTEGER NOT NULL,
    information INTEGER NOT NULL,
    why      TEXT NOT NULL,         -- JSON list: for undetermined, the checkers that failed
    xqar     TEXT NOT NULL,         -- path of the result; empty: it could not be written
    inputs   TEXT NOT NULL,         -- JSON list of [path, [size, mtime_ns, inode, digest, ctime_ns]]; null: missing, digest null: not readable
    racy     INTEGER NOT NULL,      -- 1: read so soon after a write that the stamps are not reliable
    at       INTEGER NOT NULL,
    epoch    INTEGER NOT NULL DEFAULT 0, -- epoch of the required set
    written  TEXT NOT NULL DEFAULT '',   -- size, mtime_ns, inode of the verdict file after its write
    own      TEXT NOT NULL DEFAULT '',   -- the verdict without the files that it depends on
    own_errors INTEGER NOT NULL DEFAULT 0, -- errors without the findings about those files
    rests_on TEXT NOT NULL DEFAULT ''    -- JSON list of [path, digest, verdict or null, errors]; empty: unknown
) WITHOUT ROWID;

-- The registry of required bundles. They are required until they are removed, whether they run or not.
CREATE TABLE IF NOT EXISTS members (
    name      TEXT PRIMARY KEY,
    version   TEXT NOT NULL,        -- version of the last registration
    origin    TEXT NOT NULL,        -- supervised: with a manifest or part of qcbus; joined: by hand
    catalogue TEXT NOT NULL,        -- JSON: its catalogue at that time
    at        INTEGER NOT NULL
) WITHOUT ROWID;

-- Paths of the results of removed files, until all reporters have withdrawn their reports.
CREATE TABLE IF NOT EXISTS gone (
    path     TEXT PRIMARY KEY,
    xqar     TEXT NOT NULL
) WITHOUT ROWID;

-- Every job that gave a verdict, for statistics. Rows are deleted after the retention time.
CREATE TABLE IF NOT EXISTS jobs (
    job      INTEGER PRIMARY KEY,
    path     TEXT NOT NULL,
    digest   TEXT NOT NULL,
    config   TEXT NOT NULL,
    verdict  TEXT NOT NULL,
    errors   INTEGER NOT NULL,
    warnings INTEGER NOT NULL,
    information INTEGER NOT NULL,
    bytes    INTEGER NOT NULL,      -- source bytes of the file and its dependencies
    micros   INTEGER NOT NULL,      -- from the queue to the stored result
    at       INTEGER NOT NULL
);
CREATE INDEX IF NOT EXISTS jobs_by_path ON jobs (path, at);
CREATE INDEX IF NOT EXISTS jobs_by_time ON jobs (at);

-- The part of each bundle in a job.
CREATE TABLE IF NOT EXISTS job_bundles (
    job      INTEGER NOT NULL REFERENCES jobs (job) ON DELETE CASCADE,
    bundle   TEXT NOT NULL,
    version  TEXT NOT NULL,
    micros   INTEGER NOT NULL,      -- time of the check as the bundle reports it
    failure  TEXT NOT NULL,         -- empty: no failure
    PRIMARY KEY (job, bundle)
) WITHOUT ROWID;

-- Checkers that have findings or failed.
CREATE TABLE IF NOT EXISTS job_findings (
    job      INTEGER NOT NULL REFERENCES jobs (job) ON DELETE CASCADE,
    bundle   TEXT NOT NULL,
    checker  TEXT NOT NULL,
    status   TEXT NOT NULL,
    issues   INTEGER NOT NULL,
    PRIMARY KEY (job, bundle, checker)
) WITHOUT ROWID;

-- The skipped checkers as a list. Jobs that skip the same checkers share one list, as most files of one
-- version do. It has about a hundred checkers.
CREATE TABLE IF NOT EXISTS job_skipped (
    job      INTEGER NOT NULL REFERENCES jobs (job) ON DELETE CASCADE,
    bundle   TEXT NOT NULL,
    list     INTEGER NOT NULL,      -- of checker_lists
    PRIMARY KEY (job, bundle)
) WITHOUT ROWID;

CREATE TABLE IF NOT EXISTS checker_lists (
    list     INTEGER PRIMARY KEY,   -- the first eight bytes of the digest of its content
    checkers TEXT NOT NULL          -- JSON list of checkers
);

-- Checkers that have findings or did not complete.
CREATE VIEW IF NOT EXISTS job_checkers AS
    SELECT job, bundle, checker, status, issues FROM job_findings
    UNION ALL
    SELECT job, bundle, value AS checker, 'skipped' AS status, 0 AS issues
    FROM job_skipped JOIN checker_lists USING (list), json_each(checkers);

-- The acknowledged reports of each reporter.
CREATE TABLE IF NOT EXISTS deliveries (
    path     TEXT NOT NULL,
    reporter TEXT NOT NULL,
    job      INTEGER,               -- the job of the acknowledged result; null: the file is removed, and the
                                    -- reporter has not yet withdrawn its report
    PRIMARY KEY (path, reporter)
) WITHOUT ROWID;
