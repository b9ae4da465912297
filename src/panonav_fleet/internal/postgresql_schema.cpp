
#include "panonav_fleet/internal/postgresql_schema.hpp"

#include <array>

#include "panonav/core/error.hpp"

namespace panonav::fleet {

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

-- What a robot uploads is taken by one statement, so that nobody waits for its link: the lock of the
-- memory, which all writers take, begins and ends on the server.
CREATE FUNCTION panonav.lock_memory(wanted bigint) RETURNS void LANGUAGE sql VOLATILE AS
  $$ SELECT pg_advisory_xact_lock(5786634408840658944 + wanted) $$;
-- The last id before those that are reserved; null: there is no such memory any more.
CREATE FUNCTION panonav.reserve_ids(wanted bigint, how_many bigint) RETURNS bigint
LANGUAGE plpgsql AS $$
DECLARE last bigint;
BEGIN
  PERFORM panonav.lock_memory(wanted);
  UPDATE panonav.memories SET last_view = last_view + how_many WHERE id = wanted
    RETURNING last_view - how_many INTO last;
  RETURN last;
END $$;
CREATE FUNCTION panonav.clear_recordings(wanted bigint, empty_checksum bigint) RETURNS void
LANGUAGE sql VOLATILE AS $$
  UPDATE panonav.settings SET text_value = '', checksum = empty_checksum
    WHERE memory = wanted AND key = 'parameter.recordings' AND text_value <> ''
$$;
CREATE FUNCTION panonav.notify_changes(wanted bigint, said text) RETURNS void LANGUAGE sql VOLATILE AS
  $$ SELECT pg_notify(channel, said) FROM panonav.memories WHERE id = wanted $$;
CREATE FUNCTION panonav.uploads_of(wanted bigint, of_file text, views bigint[])
RETURNS SETOF panonav.uploads LANGUAGE plpgsql AS $$
BEGIN
  PERFORM panonav.lock_memory(wanted);
  RETURN QUERY SELECT u.* FROM panonav.uploads u
    WHERE u.memory = wanted AND u.file = of_file AND u.view = ANY(views) ORDER BY u.server_view;
END $$;
-- Adds the rows of the connection's table panonav_staged, but for those that were taken before and
-- are there, and those whose name another view has; returns what is there of the file's views.
CREATE FUNCTION panonav.take_views(wanted bigint, of_file text, by_session bigint, sending bigint,
  said text, views bigint[], signatures bigint[], ids bigint[], local_checksums bigint[],
  server_checksums bigint[], numbers bigint[], thumbnail_checksums bigint[],
  features_checksums bigint[]) RETURNS SETOF panonav.uploads LANGUAGE plpgsql AS $$
BEGIN
  PERFORM panonav.lock_memory(wanted);
  INSERT INTO panonav.uploads(memory, file, view, signature, server_view, local_checksum,
    server_checksum, sent)
  SELECT wanted, of_file, n.view, n.signature, n.id, n.local_checksum, n.server_checksum, sending
  FROM unnest(views, signatures, ids, local_checksums, server_checksums, numbers)
    n(view, signature, id, local_checksum, server_checksum, number)
  JOIN pg_temp.panonav_staged s USING (number)
  WHERE NOT EXISTS (SELECT FROM panonav.views v WHERE v.memory = wanted AND v.name = s.name)
    AND NOT EXISTS (SELECT FROM panonav.uploads u JOIN panonav.views v
      ON v.memory = u.memory AND v.id = u.server_view WHERE u.memory = wanted AND
      u.file = of_file AND u.view = n.view AND u.signature = n.signature);
  WITH n AS (
    SELECT * FROM unnest(ids, server_checksums, numbers, thumbnail_checksums, features_checksums,
      views, signatures) n(id, checksum, number, thumbnail_checksum, features_checksum, view,
      signature)
    WHERE EXISTS (SELECT FROM panonav.uploads u WHERE u.memory = wanted AND u.file = of_file AND
      u.view = n.view AND u.signature = n.signature AND u.server_view = n.id)),
  added AS (
    INSERT INTO panonav.views(memory, id, name, x_m, y_m, heading_rad, stamp_s, session, signature,
      checksum)
    SELECT wanted, n.id, s.name, s.x_m, s.y_m, s.heading_rad, s.stamp_s, by_session, s.signature,
      n.checksum FROM pg_temp.panonav_staged s JOIN n USING (number)),
  thumbnails AS (
    INSERT INTO panonav.thumbnails(memory, view, bytes, checksum)
    SELECT wanted, n.id, s.thumbnail, n.thumbnail_checksum FROM pg_temp.panonav_staged s
    JOIN n USING (number) WHERE s.thumbnail IS NOT NULL)
  INSERT INTO panonav.features(memory, view, bytes, checksum)
  SELECT wanted, n.id, s.features, n.features_checksum FROM pg_temp.panonav_staged s
  JOIN n USING (number) WHERE s.features IS NOT NULL;
  PERFORM panonav.notify_changes(wanted, said);
  RETURN QUERY SELECT u.* FROM panonav.uploads u JOIN panonav.views v
    ON v.memory = u.memory AND v.id = u.server_view
    WHERE u.memory = wanted AND u.file = of_file AND u.view = ANY(take_views.views)
    ORDER BY u.server_view;
END $$;
-- Gives views the names, poses and stamps of the connection's table panonav_changed, where they are
-- still as the file knows them and no other view has the name; returns what was taken.
CREATE FUNCTION panonav.take_changes(wanted bigint, of_file text, sending bigint, said text,
  empty_checksum bigint, views bigint[], signatures bigint[], ids bigint[],
  local_checksums bigint[], former_checksums bigint[], server_checksums bigint[])
RETURNS SETOF panonav.uploads LANGUAGE plpgsql AS $$
BEGIN
  PERFORM panonav.lock_memory(wanted);
  WITH n AS (
    SELECT * FROM unnest(views, signatures, ids, local_checksums, former_checksums,
      server_checksums) n(view, signature, id, local_checksum, former_checksum, checksum)),
  changed AS (
    UPDATE panonav.views v SET name = c.name, x_m = c.x_m, y_m = c.y_m,
      heading_rad = c.heading_rad, stamp_s = c.stamp_s, checksum = n.checksum
    FROM pg_temp.panonav_changed c JOIN n USING (id)
    WHERE v.memory = wanted AND v.id = c.id AND v.checksum = n.former_checksum AND NOT EXISTS (
      SELECT FROM panonav.views o WHERE o.memory = wanted AND o.name = c.name AND o.id <> c.id)
    RETURNING v.id)
  INSERT INTO panonav.uploads(memory, file, view, signature, server_view, local_checksum,
    server_checksum, sent)
  SELECT wanted, of_file, n.view, n.signature, n.id, n.local_checksum, n.checksum, sending
  FROM n JOIN changed USING (id)
  ON CONFLICT (memory, file, view, signature, server_view) DO UPDATE SET
    local_checksum = excluded.local_checksum, server_checksum = excluded.server_checksum,
    sent = excluded.sent;
  PERFORM panonav.clear_recordings(wanted, empty_checksum);
  PERFORM panonav.notify_changes(wanted, said);
  RETURN QUERY SELECT u.* FROM panonav.uploads u WHERE u.memory = wanted AND u.file = of_file AND
    u.view = ANY(take_changes.views) AND u.server_view = ANY(ids) AND u.sent = sending;
END $$;
-- Removes views that have these checksums, with all that belongs to them; returns which. Maps are
-- for the program to change: where there are any, nothing is removed.
CREATE FUNCTION panonav.take_removals(wanted bigint, said text, empty_checksum bigint, ids bigint[],
  checksums bigint[]) RETURNS SETOF bigint LANGUAGE plpgsql AS $$
DECLARE removed bigint[];
BEGIN
  PERFORM panonav.lock_memory(wanted);
  IF EXISTS (SELECT FROM panonav.maps WHERE memory = wanted) THEN RETURN; END IF;
  WITH gone AS (
    DELETE FROM panonav.views v USING unnest(ids, checksums) n(id, checksum)
    WHERE v.memory = wanted AND v.id = n.id AND v.checksum = n.checksum RETURNING v.id)
  SELECT array_agg(id) INTO removed FROM gone;
  DELETE FROM panonav.links WHERE memory = wanted AND (a = ANY(removed) OR b = ANY(removed));
  DELETE FROM panonav.thumbnails WHERE memory = wanted AND view = ANY(removed);
  DELETE FROM panonav.features WHERE memory = wanted AND view = ANY(removed);
  PERFORM panonav.clear_recordings(wanted, empty_checksum);
  PERFORM panonav.notify_changes(wanted, said);
  RETURN QUERY SELECT unnest(removed);
END $$;
-- Adds links of views that are there where these have none, gives links another kind where they
-- have the former one, and removes links; returns how many.
CREATE FUNCTION panonav.take_links(wanted bigint, a_new bigint[], b_new bigint[], kinds bigint[],
  checksums bigint[], a_changed bigint[], b_changed bigint[], former_kinds bigint[],
  new_kinds bigint[], new_checksums bigint[], a_removed bigint[], b_removed bigint[])
RETURNS bigint LANGUAGE plpgsql AS $$
DECLARE
  total bigint := 0;
  done bigint;
BEGIN
  PERFORM panonav.lock_memory(wanted);
  INSERT INTO panonav.links(memory, a, b, kind, checksum)
  SELECT wanted, n.a, n.b, n.kind, n.checksum
  FROM unnest(a_new, b_new, kinds, checksums) n(a, b, kind, checksum)
  WHERE EXISTS (SELECT FROM panonav.views v WHERE v.memory = wanted AND v.id = n.a) AND EXISTS
    (SELECT FROM panonav.views v WHERE v.memory = wanted AND v.id = n.b) ON CONFLICT DO NOTHING;
  GET DIAGNOSTICS done = ROW_COUNT;
  total := total + done;
  UPDATE panonav.links l SET kind = n.wanted_kind, checksum = n.checksum
  FROM unnest(a_changed, b_changed, former_kinds, new_kinds, new_checksums)
    n(a, b, former_kind, wanted_kind, checksum)
  WHERE l.memory = wanted AND l.a = n.a AND l.b = n.b AND l.kind = n.former_kind;
  GET DIAGNOSTICS done = ROW_COUNT;
  total := total + done;
  IF cardinality(a_removed) > 0 THEN
    DELETE FROM panonav.links l USING unnest(a_removed, b_removed) n(a, b)
    WHERE l.memory = wanted AND l.a = n.a AND l.b = n.b;
    GET DIAGNOSTICS done = ROW_COUNT;
    total := total + done;
  END IF;
  PERFORM panonav.notify_changes(wanted, '');
  RETURN total;
END $$;
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

}  // namespace panonav::fleet
