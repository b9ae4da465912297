-- Each function takes what a robot uploads in one statement, so that nobody waits for its link: the
-- lock of the memory, which all writers take, begins and ends on the server.
CREATE FUNCTION panonav.lock_memory(memory_id bigint) RETURNS void LANGUAGE sql VOLATILE AS
  $$ SELECT pg_advisory_xact_lock(5786634408840658944 + memory_id) $$;
-- The last id before those that are reserved; null: there is no such memory any more.
CREATE FUNCTION panonav.reserve_ids(memory_id bigint, how_many bigint) RETURNS bigint
LANGUAGE plpgsql AS $$
DECLARE last bigint;
BEGIN
  PERFORM panonav.lock_memory(memory_id);
  UPDATE panonav.memories SET last_view = last_view + how_many WHERE id = memory_id
    RETURNING last_view - how_many INTO last;
  RETURN last;
END $$;
CREATE FUNCTION panonav.clear_recordings(memory_id bigint, empty_checksum bigint) RETURNS void
LANGUAGE sql VOLATILE AS $$
  UPDATE panonav.settings SET text_value = '', checksum = empty_checksum
    WHERE memory = memory_id AND key = 'parameter.recordings' AND text_value <> ''
$$;
CREATE FUNCTION panonav.notify_changes(memory_id bigint, areas text) RETURNS void
LANGUAGE sql VOLATILE AS
  $$ SELECT pg_notify(channel, areas) FROM panonav.memories WHERE id = memory_id $$;
CREATE FUNCTION panonav.uploads_of(memory_id bigint, file_id text, views bigint[])
RETURNS SETOF panonav.uploads LANGUAGE plpgsql AS $$
BEGIN
  PERFORM panonav.lock_memory(memory_id);
  RETURN QUERY SELECT u.* FROM panonav.uploads u
    WHERE u.memory = memory_id AND u.file = file_id AND u.view = ANY(views) ORDER BY u.server_view;
END $$;
-- Adds the rows of the connection's table panonav_staged, but for those that were taken before and
-- are there, and those whose name another view has; returns what is there of the file's views.
CREATE FUNCTION panonav.take_views(memory_id bigint, file_id text, session_id bigint,
  sent_number bigint, areas text, views bigint[], signatures bigint[], ids bigint[],
  local_checksums bigint[], server_checksums bigint[], numbers bigint[], thumbnail_checksums bigint[],
  features_checksums bigint[]) RETURNS SETOF panonav.uploads LANGUAGE plpgsql AS $$
BEGIN
  PERFORM panonav.lock_memory(memory_id);
  INSERT INTO panonav.uploads(memory, file, view, signature, server_view, local_checksum,
    server_checksum, sent)
  SELECT memory_id, file_id, n.view, n.signature, n.id, n.local_checksum, n.server_checksum,
    sent_number
  FROM unnest(views, signatures, ids, local_checksums, server_checksums, numbers)
    n(view, signature, id, local_checksum, server_checksum, number)
  JOIN pg_temp.panonav_staged s USING (number)
  WHERE NOT EXISTS (SELECT FROM panonav.views v WHERE v.memory = memory_id AND v.name = s.name)
    AND NOT EXISTS (SELECT FROM panonav.uploads u JOIN panonav.views v
      ON v.memory = u.memory AND v.id = u.server_view WHERE u.memory = memory_id AND
      u.file = file_id AND u.view = n.view AND u.signature = n.signature);
  WITH n AS (
    SELECT * FROM unnest(ids, server_checksums, numbers, thumbnail_checksums, features_checksums,
      views, signatures) n(id, checksum, number, thumbnail_checksum, features_checksum, view,
      signature)
    WHERE EXISTS (SELECT FROM panonav.uploads u WHERE u.memory = memory_id AND u.file = file_id AND
      u.view = n.view AND u.signature = n.signature AND u.server_view = n.id)),
  added AS (
    INSERT INTO panonav.views(memory, id, name, x_m, y_m, heading_rad, stamp_s, session, signature,
      checksum)
    SELECT memory_id, n.id, s.name, s.x_m, s.y_m, s.heading_rad, s.stamp_s, session_id, s.signature,
      n.checksum FROM pg_temp.panonav_staged s JOIN n USING (number)),
  thumbnails AS (
    INSERT INTO panonav.thumbnails(memory, view, bytes, checksum)
    SELECT memory_id, n.id, s.thumbnail, n.thumbnail_checksum FROM pg_temp.panonav_staged s
    JOIN n USING (number) WHERE s.thumbnail IS NOT NULL)
  INSERT INTO panonav.features(memory, view, bytes, checksum)
  SELECT memory_id, n.id, s.features, n.features_checksum FROM pg_temp.panonav_staged s
  JOIN n USING (number) WHERE s.features IS NOT NULL;
  PERFORM panonav.notify_changes(memory_id, areas);
  RETURN QUERY SELECT u.* FROM panonav.uploads u JOIN panonav.views v
    ON v.memory = u.memory AND v.id = u.server_view
    WHERE u.memory = memory_id AND u.file = file_id AND u.view = ANY(take_views.views)
    ORDER BY u.server_view;
END $$;
-- Gives views the names, poses and stamps of the connection's table panonav_changed, where they are
-- still as the file knows them and no other view has the name; returns what was taken.
CREATE FUNCTION panonav.take_changes(memory_id bigint, file_id text, sent_number bigint, areas text,
  empty_checksum bigint, views bigint[], signatures bigint[], ids bigint[],
  local_checksums bigint[], former_checksums bigint[], server_checksums bigint[])
RETURNS SETOF panonav.uploads LANGUAGE plpgsql AS $$
BEGIN
  PERFORM panonav.lock_memory(memory_id);
  WITH n AS (
    SELECT * FROM unnest(views, signatures, ids, local_checksums, former_checksums,
      server_checksums) n(view, signature, id, local_checksum, former_checksum, checksum)),
  changed AS (
    UPDATE panonav.views v SET name = c.name, x_m = c.x_m, y_m = c.y_m,
      heading_rad = c.heading_rad, stamp_s = c.stamp_s, checksum = n.checksum
    FROM pg_temp.panonav_changed c JOIN n USING (id)
    WHERE v.memory = memory_id AND v.id = c.id AND v.checksum = n.former_checksum AND NOT EXISTS (
      SELECT FROM panonav.views o WHERE o.memory = memory_id AND o.name = c.name AND o.id <> c.id)
    RETURNING v.id)
  INSERT INTO panonav.uploads(memory, file, view, signature, server_view, local_checksum,
    server_checksum, sent)
  SELECT memory_id, file_id, n.view, n.signature, n.id, n.local_checksum, n.checksum, sent_number
  FROM n JOIN changed USING (id)
  ON CONFLICT (memory, file, view, signature, server_view) DO UPDATE SET
    local_checksum = excluded.local_checksum, server_checksum = excluded.server_checksum,
    sent = excluded.sent;
  PERFORM panonav.clear_recordings(memory_id, empty_checksum);
  PERFORM panonav.notify_changes(memory_id, areas);
  RETURN QUERY SELECT u.* FROM panonav.uploads u WHERE u.memory = memory_id AND u.file = file_id AND
    u.view = ANY(take_changes.views) AND u.server_view = ANY(ids) AND u.sent = sent_number;
END $$;
-- Removes views that have these checksums, with all that belongs to them; returns which. Maps are
-- for the program to change: where there are any, nothing is removed.
CREATE FUNCTION panonav.take_removals(memory_id bigint, areas text, empty_checksum bigint,
  ids bigint[],
  checksums bigint[]) RETURNS SETOF bigint LANGUAGE plpgsql AS $$
DECLARE removed bigint[];
BEGIN
  PERFORM panonav.lock_memory(memory_id);
  IF EXISTS (SELECT FROM panonav.maps WHERE memory = memory_id) THEN RETURN; END IF;
  WITH gone AS (
    DELETE FROM panonav.views v USING unnest(ids, checksums) n(id, checksum)
    WHERE v.memory = memory_id AND v.id = n.id AND v.checksum = n.checksum RETURNING v.id)
  SELECT array_agg(id) INTO removed FROM gone;
  DELETE FROM panonav.links WHERE memory = memory_id AND (a = ANY(removed) OR b = ANY(removed));
  DELETE FROM panonav.thumbnails WHERE memory = memory_id AND view = ANY(removed);
  DELETE FROM panonav.features WHERE memory = memory_id AND view = ANY(removed);
  PERFORM panonav.clear_recordings(memory_id, empty_checksum);
  PERFORM panonav.notify_changes(memory_id, areas);
  RETURN QUERY SELECT unnest(removed);
END $$;
-- Adds links of views that are there where these have none, gives links another kind where they
-- have the former one, and removes links; returns how many.
CREATE FUNCTION panonav.take_links(memory_id bigint, a_new bigint[], b_new bigint[], kinds bigint[],
  checksums bigint[], a_changed bigint[], b_changed bigint[], former_kinds bigint[],
  new_kinds bigint[], new_checksums bigint[], a_removed bigint[], b_removed bigint[])
RETURNS bigint LANGUAGE plpgsql AS $$
DECLARE
  total bigint := 0;
  changed_rows bigint;
BEGIN
  PERFORM panonav.lock_memory(memory_id);
  INSERT INTO panonav.links(memory, a, b, kind, checksum)
  SELECT memory_id, n.a, n.b, n.kind, n.checksum
  FROM unnest(a_new, b_new, kinds, checksums) n(a, b, kind, checksum)
  WHERE EXISTS (SELECT FROM panonav.views v WHERE v.memory = memory_id AND v.id = n.a) AND EXISTS
    (SELECT FROM panonav.views v WHERE v.memory = memory_id AND v.id = n.b) ON CONFLICT DO NOTHING;
  GET DIAGNOSTICS changed_rows = ROW_COUNT;
  total := total + changed_rows;
  UPDATE panonav.links l SET kind = n.new_kind, checksum = n.checksum
  FROM unnest(a_changed, b_changed, former_kinds, new_kinds, new_checksums)
    n(a, b, former_kind, new_kind, checksum)
  WHERE l.memory = memory_id AND l.a = n.a AND l.b = n.b AND l.kind = n.former_kind;
  GET DIAGNOSTICS changed_rows = ROW_COUNT;
  total := total + changed_rows;
  IF cardinality(a_removed) > 0 THEN
    DELETE FROM panonav.links l USING unnest(a_removed, b_removed) n(a, b)
    WHERE l.memory = memory_id AND l.a = n.a AND l.b = n.b;
    GET DIAGNOSTICS changed_rows = ROW_COUNT;
    total := total + changed_rows;
  END IF;
  PERFORM panonav.notify_changes(memory_id, '');
  RETURN total;
END $$;
