#ifdef PANONAV_WITH_POSTGRESQL

#include "panonav/storage/internal/postgresql_schema.hpp"

#include <array>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

// "PNAV" in the upper half: nobody else locks that number.
constexpr const char* lock_schema = "SELECT pg_advisory_xact_lock(5786634408840658944)";

// What brings the schema from version i to i + 1. Roles belong to the whole server, and another
// database of it may have made them.
constexpr std::array<const char*, postgresql_schema_version> migrations{R"sql(
CREATE SCHEMA panonav;
REVOKE ALL ON SCHEMA panonav FROM PUBLIC;
DO $$
DECLARE wanted text;
BEGIN
  FOREACH wanted IN ARRAY ARRAY['panonav_reader', 'panonav_contributor', 'panonav_curator'] LOOP
    BEGIN
      IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = wanted) THEN
        EXECUTE format('CREATE ROLE %I NOLOGIN', wanted);
      END IF;
    EXCEPTION WHEN duplicate_object OR unique_violation THEN NULL;
    END;
  END LOOP;
END $$;
GRANT panonav_reader TO panonav_contributor;
GRANT panonav_contributor TO panonav_curator;

CREATE TABLE panonav.schema_version(version integer NOT NULL);
INSERT INTO panonav.schema_version VALUES (1);

-- Whose memories a login sees. Logins that are not listed are all of the fleet ''. By the login
-- itself, as whoever is a member of a role may take that role's name.
CREATE TABLE panonav.members(login name PRIMARY KEY, fleet text COLLATE "C" NOT NULL);
CREATE FUNCTION panonav.fleet() RETURNS text LANGUAGE sql STABLE AS
  $$ SELECT coalesce((SELECT fleet FROM panonav.members WHERE login = session_user), '') $$;

-- `channel` cannot be guessed: only who may read the memory can listen to its changes.
CREATE TABLE panonav.memories(
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  fleet text COLLATE "C" NOT NULL DEFAULT panonav.fleet(),
  name text COLLATE "C" NOT NULL,
  last_view bigint NOT NULL DEFAULT 0,
  channel text NOT NULL DEFAULT 'panonav_' || replace(gen_random_uuid()::text, '-', ''),
  UNIQUE (fleet, name));

CREATE TABLE panonav.robots(
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  fleet text COLLATE "C" NOT NULL DEFAULT panonav.fleet(),
  name text COLLATE "C" NOT NULL,
  UNIQUE (fleet, name));
-- A connection that added views.
CREATE TABLE panonav.sessions(
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  memory bigint NOT NULL REFERENCES panonav.memories ON DELETE CASCADE,
  robot bigint NOT NULL REFERENCES panonav.robots,
  login name NOT NULL DEFAULT session_user,
  began timestamptz NOT NULL DEFAULT now());

CREATE TABLE panonav.settings(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  key text COLLATE "C",
  integer_value bigint, real_value double precision, text_value text, bytes_value bytea,
  checksum bigint NOT NULL,
  PRIMARY KEY (memory, key),
  CHECK (num_nonnulls(integer_value, real_value, text_value, bytes_value) = 1));

-- Signatures do not compress and are as long as a quarter of a page: they stay in their row.
CREATE TABLE panonav.views(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  id bigint CHECK (id BETWEEN 1 AND 4294967295),
  name text COLLATE "C" NOT NULL,
  x_m double precision, y_m double precision, heading_rad double precision,
  stamp_s double precision,
  session bigint,
  signature bytea NOT NULL,
  checksum bigint NOT NULL,
  PRIMARY KEY (memory, id),
  UNIQUE (memory, name)) WITH (toast_tuple_target = 8160);
ALTER TABLE panonav.views ALTER signature SET STORAGE EXTERNAL;
-- Bare columns: under row-level security no index on what a function makes of them is used, as the
-- function could tell rows of others by failing.
CREATE INDEX views_by_position ON panonav.views(memory, x_m, y_m) WHERE x_m IS NOT NULL;

CREATE TABLE panonav.thumbnails(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  view bigint, bytes bytea NOT NULL, checksum bigint NOT NULL, PRIMARY KEY (memory, view));
ALTER TABLE panonav.thumbnails ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE panonav.features(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  view bigint, bytes bytea NOT NULL, checksum bigint NOT NULL, PRIMARY KEY (memory, view));
ALTER TABLE panonav.features ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE panonav.links(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  a bigint, b bigint, kind bigint NOT NULL, checksum bigint NOT NULL,
  PRIMARY KEY (memory, a, b));
CREATE INDEX links_by_b ON panonav.links(memory, b);
CREATE TABLE panonav.maps(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  name text COLLATE "C", nodes bytea NOT NULL, edges bytea NOT NULL, checksum bigint NOT NULL,
  PRIMARY KEY (memory, name));
CREATE TABLE panonav.routes(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  name text COLLATE "C", columns bigint NOT NULL, lines bigint NOT NULL, checksum bigint NOT NULL,
  PRIMARY KEY (memory, name));
CREATE TABLE panonav.route_blocks(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  route text COLLATE "C", number bigint, lines bytea NOT NULL, checksum bigint NOT NULL,
  PRIMARY KEY (memory, route, number));
ALTER TABLE panonav.route_blocks ALTER lines SET STORAGE EXTERNAL;

-- The last change that can be undone: every row before and after it, in order.
CREATE TABLE panonav.undo(
  memory bigint PRIMARY KEY REFERENCES panonav.memories ON DELETE CASCADE, what text NOT NULL);
CREATE TABLE panonav.undo_rows(
  number bigint GENERATED ALWAYS AS IDENTITY,
  memory bigint NOT NULL REFERENCES panonav.memories ON DELETE CASCADE,
  relation name NOT NULL, before text, after text, PRIMARY KEY (memory, number));
CREATE FUNCTION panonav.keep_for_undo() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  IF TG_OP = 'INSERT' THEN
    INSERT INTO panonav.undo_rows(memory, relation, after)
      VALUES (NEW.memory, TG_TABLE_NAME, NEW::text);
  ELSIF TG_OP = 'UPDATE' THEN
    INSERT INTO panonav.undo_rows(memory, relation, before, after)
      VALUES (NEW.memory, TG_TABLE_NAME, OLD::text, NEW::text);
  ELSE
    INSERT INTO panonav.undo_rows(memory, relation, before)
      VALUES (OLD.memory, TG_TABLE_NAME, OLD::text);
  END IF;
  RETURN NULL;
END $$;
-- Null: done. Otherwise the table in which a row is not as the change left it. Settings are notes on
-- the views, which are checked when they are used: newer ones stay.
CREATE FUNCTION panonav.undo(wanted bigint) RETURNS text LANGUAGE plpgsql AS $$
DECLARE
  kept record;
  key text;
  done bigint;
BEGIN
  FOR kept IN SELECT * FROM panonav.undo_rows WHERE memory = wanted ORDER BY number DESC LOOP
    key := CASE kept.relation WHEN 'views' THEN 'id' WHEN 'thumbnails' THEN 'view'
      WHEN 'features' THEN 'view' WHEN 'links' THEN 'a, b' WHEN 'maps' THEN 'name'
      WHEN 'routes' THEN 'name' WHEN 'route_blocks' THEN 'route, number' WHEN 'settings' THEN 'key'
      END;
    IF kept.after IS NOT NULL THEN
      EXECUTE format('DELETE FROM panonav.%1$I t WHERE memory = $2 AND (%2$s) = '
        '(SELECT %2$s FROM (SELECT ($1::panonav.%1$I).*) k) AND t::text = $1',
        kept.relation, key) USING kept.after, wanted;
      GET DIAGNOSTICS done = ROW_COUNT;
      IF done = 0 THEN
        CONTINUE WHEN kept.relation = 'settings';
        RETURN kept.relation;
      END IF;
    END IF;
    IF kept.before IS NOT NULL THEN
      EXECUTE format('INSERT INTO panonav.%1$I SELECT ($1::panonav.%1$I).* ON CONFLICT DO NOTHING',
        kept.relation) USING kept.before;
      GET DIAGNOSTICS done = ROW_COUNT;
      IF done = 0 AND kept.relation <> 'settings' THEN RETURN kept.relation; END IF;
    END IF;
  END LOOP;
  DELETE FROM panonav.undo WHERE memory = wanted;
  DELETE FROM panonav.undo_rows WHERE memory = wanted;
  RETURN NULL;
END $$;

DO $$
DECLARE part text;
BEGIN
  FOREACH part IN ARRAY ARRAY['settings', 'views', 'thumbnails', 'features', 'links', 'maps',
                              'routes', 'route_blocks', 'sessions', 'undo', 'undo_rows'] LOOP
    EXECUTE format('ALTER TABLE panonav.%I ENABLE ROW LEVEL SECURITY', part);
    EXECUTE format('CREATE POLICY own_fleet ON panonav.%I USING (memory IN '
                   '(SELECT id FROM panonav.memories))', part);
    CONTINUE WHEN part IN ('sessions', 'undo', 'undo_rows');
    EXECUTE format('CREATE TRIGGER keep_for_undo AFTER INSERT OR UPDATE OR DELETE ON panonav.%I '
      'FOR EACH ROW WHEN (current_setting(''panonav.undo'', true) = ''on'') '
      'EXECUTE FUNCTION panonav.keep_for_undo()', part);
  END LOOP;
END $$;
ALTER TABLE panonav.memories ENABLE ROW LEVEL SECURITY;
CREATE POLICY own_fleet ON panonav.memories USING (fleet = (SELECT panonav.fleet()));
ALTER TABLE panonav.robots ENABLE ROW LEVEL SECURITY;
CREATE POLICY own_fleet ON panonav.robots USING (fleet = (SELECT panonav.fleet()));
ALTER TABLE panonav.members ENABLE ROW LEVEL SECURITY;
CREATE POLICY oneself ON panonav.members USING (login = session_user);
-- What views are made with is fixed when the memory is made.
CREATE POLICY fixed_header ON panonav.settings AS RESTRICTIVE FOR UPDATE
  USING (key LIKE 'parameter.%');

GRANT USAGE ON SCHEMA panonav TO panonav_reader;
GRANT SELECT ON ALL TABLES IN SCHEMA panonav TO panonav_reader;
GRANT INSERT ON panonav.memories, panonav.robots, panonav.sessions, panonav.settings, panonav.views,
  panonav.thumbnails, panonav.features, panonav.links, panonav.maps, panonav.routes,
  panonav.route_blocks TO panonav_contributor;
GRANT UPDATE(last_view) ON panonav.memories TO panonav_contributor;
GRANT UPDATE ON panonav.settings, panonav.links, panonav.maps, panonav.routes, panonav.route_blocks
  TO panonav_contributor;
GRANT UPDATE ON panonav.views TO panonav_curator;
GRANT DELETE ON panonav.memories, panonav.settings, panonav.views, panonav.thumbnails,
  panonav.features, panonav.links, panonav.maps, panonav.routes, panonav.route_blocks
  TO panonav_curator;
GRANT INSERT, UPDATE, DELETE ON panonav.undo, panonav.undo_rows TO panonav_curator;
)sql",
                                                                        R"sql(
-- Which memory this is, whatever its name is and whichever server it lies on.
ALTER TABLE panonav.memories ADD COLUMN identity text COLLATE "C" NOT NULL
  DEFAULT replace(gen_random_uuid()::text, '-', '');

-- What was taken last from a view of a robot's file, in the transaction that took it. A row stays
-- when somebody removes the view: a robot that missed the answer does not bring it back.
CREATE TABLE panonav.uploads(
  memory bigint REFERENCES panonav.memories ON DELETE CASCADE,
  file text COLLATE "C", view bigint, signature bigint,
  server_view bigint NOT NULL, local_checksum bigint NOT NULL, server_checksum bigint NOT NULL,
  sent bigint NOT NULL,
  PRIMARY KEY (memory, file, view, signature, server_view));
ALTER TABLE panonav.uploads ENABLE ROW LEVEL SECURITY;
CREATE POLICY own_fleet ON panonav.uploads USING (memory IN (SELECT id FROM panonav.memories));
GRANT SELECT ON panonav.uploads TO panonav_reader;
GRANT INSERT ON panonav.uploads TO panonav_contributor;
GRANT UPDATE ON panonav.uploads TO panonav_curator;

-- What has changed is found by checksums alone: without the rows, which are a hundred times as long.
CREATE INDEX views_by_checksum ON panonav.views(memory, id) INCLUDE (checksum);
UPDATE panonav.schema_version SET version = 2;
)sql"};

}  // namespace

int schema_version(PostgresqlConnection& connection) {
  const auto there = connection.run(
      "SELECT (to_regclass('panonav.schema_version') IS NOT NULL)::int4::int8, "
      "(EXISTS (SELECT FROM pg_namespace WHERE nspname = 'panonav'))::int4::int8");
  if (there.integer(0, 0) == 0) {
    if (there.integer(0, 1) != 0 &&
        connection.run("SELECT has_schema_privilege('panonav', 'USAGE')::int4::int8")
                .integer(0, 0) != 0) {
      throw FileError(connection.shown().native(),
                      "cannot be used: the database has a schema panonav of another program");
    }
    return 0;
  }
  return static_cast<int>(
      connection.run("SELECT version::int8 FROM panonav.schema_version").integer(0, 0));
}

bool may_migrate_schema(PostgresqlConnection& connection) {
  return connection
             .run(
                 "SELECT count(*) FROM pg_namespace WHERE nspname = 'panonav' AND "
                 "pg_has_role(nspowner, 'USAGE')")
             .integer(0, 0) != 0;
}

void migrate_schema(PostgresqlConnection& connection) {
  connection.execute("BEGIN");
  try {
    connection.execute(lock_schema);
    for (int version = schema_version(connection); version < postgresql_schema_version; ++version) {
      connection.execute(migrations.at(static_cast<std::size_t>(version)));
    }
    connection.execute("COMMIT");
  } catch (...) {
    connection.try_execute("ROLLBACK");
    throw;
  }
}

}  // namespace panonav

#endif
