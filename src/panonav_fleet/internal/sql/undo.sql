-- Keeps each row that a change replaces, drops or adds.
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
-- Returns null, or the table in which a row is not as the change left it. Settings are notes on the
-- views, which are checked when they are used: newer ones stay. Fails on rows of other tables or
-- memories: a curator may write any, and whoever undoes them may have more rights.
CREATE FUNCTION panonav.undo(memory_id bigint) RETURNS text LANGUAGE plpgsql AS $$
DECLARE
  change record;
  key text;
  row_memory bigint;
  changed_rows bigint;
BEGIN
  FOR change IN SELECT * FROM panonav.undo_rows WHERE memory = memory_id ORDER BY number DESC LOOP
    key := CASE change.relation WHEN 'views' THEN 'id' WHEN 'thumbnails' THEN 'view'
      WHEN 'features' THEN 'view' WHEN 'links' THEN 'a, b' WHEN 'maps' THEN 'name'
      WHEN 'routes' THEN 'name' WHEN 'route_blocks' THEN 'route, number' WHEN 'settings' THEN 'key'
      END;
    IF key IS NULL THEN
      RAISE data_corrupted USING MESSAGE =
        format('a row kept for undo is of the table %s, which undo does not change', change.relation);
    END IF;
    IF change.before IS NOT NULL THEN
      EXECUTE format('SELECT ($1::panonav.%I).memory', change.relation) INTO row_memory
        USING change.before;
      IF row_memory IS DISTINCT FROM memory_id THEN
        RAISE data_corrupted USING MESSAGE = 'a row kept for undo is of another memory';
      END IF;
    END IF;
    IF change.after IS NOT NULL THEN
      EXECUTE format('DELETE FROM panonav.%1$I t WHERE memory = $2 AND (%2$s) = '
        '(SELECT %2$s FROM (SELECT ($1::panonav.%1$I).*) k) AND t::text = $1',
        change.relation, key) USING change.after, memory_id;
      GET DIAGNOSTICS changed_rows = ROW_COUNT;
      IF changed_rows = 0 THEN
        CONTINUE WHEN change.relation = 'settings';
        RETURN change.relation;
      END IF;
    END IF;
    IF change.before IS NOT NULL THEN
      EXECUTE format('INSERT INTO panonav.%1$I SELECT ($1::panonav.%1$I).* ON CONFLICT DO NOTHING',
        change.relation) USING change.before;
      GET DIAGNOSTICS changed_rows = ROW_COUNT;
      IF changed_rows = 0 AND change.relation <> 'settings' THEN RETURN change.relation; END IF;
    END IF;
  END LOOP;
  DELETE FROM panonav.undo WHERE memory = memory_id;
  DELETE FROM panonav.undo_rows WHERE memory = memory_id;
  RETURN NULL;
END $$;
