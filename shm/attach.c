/* SPDX-License-Identifier: MIT */
/*
 * Attach to one root of one daemon, and let go of it.
 *
 * Order: the manifest first, because only it can say in words that two
 * versions met; then everything is opened; only when all of it stands is it
 * handed to the realtime thread. If anything fails, all is closed again.
 *
 * The commander's place is given to one. Three ways to be refused, each with
 * its own line: another one has it, the last one died and the daemon has not
 * made the place anew yet, no permission.
 */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include "shm/client_private.h"
#include "shm/manifest.h"
#include "shm/room.h"
#include "shm/say.h"

enum {
	SERVICE_NAME_MAX = POKEYS_SHM_NAME_MAX + 24,
	ATTACH_FILES = 24, /* 15 stay open */
	ATTACH_BYTES = 64 * 1024,
};

struct attachment {
	struct iox_node *node;
	struct iox_state_reader *state;
	struct iox_diag_reader *diag;
	struct iox_command_writer *command;
	struct iox_report_reader *report;
	struct iox_wish_writer *wish;
};

/* The wish before the command: whoever finds the place of commander free has both. */
static void release(struct attachment *attachment)
{
	if (attachment->wish)
		iox_wish_writer_close(attachment->wish);
	if (attachment->command)
		iox_command_writer_close(attachment->command);
	if (attachment->report)
		iox_report_reader_close(attachment->report);
	if (attachment->diag)
		iox_diag_reader_close(attachment->diag);
	if (attachment->state)
		iox_state_reader_close(attachment->state);
	if (attachment->node)
		iox_node_close(attachment->node);
}

static const char *service_name(char name[SERVICE_NAME_MAX], const struct pokeys_client *client,
				const char *image)
{
	snprintf(name, SERVICE_NAME_MAX, "pokeys/%s/%s", client->device, image);
	return name;
}

/* For a moment: it is no reason to give up. */
static int is_being_made(const char *root, char *why, size_t size)
{
	return say(why, size, -ENOENT, "the daemon in %s is making its files", root);
}

static int check_manifest(const struct pokeys_client *client, const char *root, char *why,
			  size_t size)
{
	struct manifest manifest;
	int r = manifest_read(root, &manifest);

	if (r == -ENOENT)
		return say(why, size, r, "the daemon that was in %s is gone", root);
	if (r == -EACCES)
		return runtime_denied(root, why, size);
	if (r)
		return say(why, size, r, "%s/" SHM_MANIFEST ": not made by pokeysd (%s)", root,
			   strerror(-r));
	r = manifest_check(&manifest, why, size);
	if (r)
		return r;
	if (!manifest_has_device(&manifest, client->device))
		return say(why, size, -ENODEV, "the daemon has no device '%s'; it has: %s%s",
			   client->device, manifest.devices ? manifest.device[0] : "none",
			   manifest.devices > 1 ? ", ..." : "");
	r = manifest_check_segments(root, why, size);
	if (!r)
		r = runtime_check_root(client->directory, root, why, size);
	return r == -ENOENT ? say(why, size, r, "the daemon that was in %s is gone", root) : r;
}

/*
 * The commander's place first: whoever does not get it takes no seat of a reader, so the one
 * who has it finds its seats free.
 */
static int open_ports(const struct pokeys_client *client, struct attachment *attachment,
		      struct iox_error *error)
{
	const struct iox_node *node = attachment->node;
	char name[SERVICE_NAME_MAX];
	int r;

	r = iox_command_writer_open(node, service_name(name, client, "command"),
				    &attachment->command, error);
	if (!r)
		r = iox_wish_writer_open(node, service_name(name, client, "wish"),
					 &attachment->wish, error);
	if (!r)
		r = iox_state_reader_open(node, service_name(name, client, "state"),
					  &attachment->state, error);
	if (!r)
		r = iox_diag_reader_open(node, service_name(name, client, "diag"),
					 &attachment->diag, error);
	if (!r)
		r = iox_report_reader_open(node, service_name(name, client, "settings"),
					   &attachment->report, error);
	return r;
}

/*
 * A root that was removed while we opened it: our node may have made folders
 * in it again. Its daemon is gone and no other one will ever use the name.
 */
static void remove_remains(const struct pokeys_client *client, const char *root_name)
{
	int fd = open(client->directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);

	if (fd < 0)
		return;
	runtime_remove_tree(fd, root_name);
	close(fd);
}

/*
 * Who is it? Its name, if this process may see it: another user's process may
 * be hidden (hidepid, ProtectProc=) and live all the same.
 */
static int explain_busy(const struct pokeys_client *client, const struct iox_node *node, char *why,
			size_t size)
{
	char service[SERVICE_NAME_MAX];
	char path[32], comm[24] = "";
	int32_t pid = 0;
	FILE *file;

	iox_writers(node, service_name(service, client, "command"), &pid, NULL);
	snprintf(path, sizeof(path), "/proc/%d/comm", (int)pid);
	file = fopen(path, "re");
	if (file) {
		if (fgets(comm, sizeof(comm), file))
			comm[strcspn(comm, "\n")] = '\0';
		fclose(file);
	}
	if (!file && pid > 0 && kill(pid, 0) && errno == ESRCH)
		return say(why, size, -EBUSY,
			   "another commander held device '%s': process %d, which is gone; "
			   "the daemon is clearing its place",
			   client->device, (int)pid);
	return say(why, size, -EBUSY,
		   "another commander holds device '%s': process %d (%s); end it first",
		   client->device, (int)pid, *comm ? comm : "its name is hidden");
}

static int explain(const struct pokeys_client *client, const struct attachment *attachment,
		   const char *root, int r, const struct iox_error *error, char *why, size_t size)
{
	switch (r) {
	case -EBUSY:
		return explain_busy(client, attachment->node, why, size);
	case -EDEADLK:
		return say(why, size, r,
			   "the last commander of device '%s' died; "
			   "the daemon is clearing its place",
			   client->device);
	case -EUSERS:
		return say(why, size, r, "device '%s' has %d readers already", client->device,
			   POKEYS_SHM_READERS);
	case -EACCES:
		return runtime_denied(root, why, size);
	case -ENOENT:
		return say(why, size, r, "the daemon that was in %s is gone", root);
	default:
		return say(why, size, r, "%s: device '%s' cannot be opened: %s (%s)", root,
			   client->device, strerror(-r), error->text);
	}
}

/*
 * A new commander begins with empty images in both cells: the daemon does
 * not take the last one's wishes for its, and the pages are there before the
 * realtime thread writes to them.
 */
static void clear_command(struct iox_command_writer *writer)
{
	struct pokeys_command *cell;

	for (int i = 0; i < 2; i++) {
		cell = iox_command_loan(writer);
		if (!cell)
			return;
		memset(cell, 0, sizeof(*cell));
		iox_command_commit(writer);
	}
}

static void clear_wish(struct iox_wish_writer *writer)
{
	struct pokeys_wish *cell;

	for (int i = 0; i < 2; i++) {
		cell = iox_wish_loan(writer);
		if (!cell)
			return;
		memset(cell, 0, sizeof(*cell));
		iox_wish_commit(writer);
	}
}

static void hand_over(struct pokeys_client *client, const struct attachment *attachment)
{
	clear_command(attachment->command);
	clear_wish(attachment->wish);
	client->written = NULL;
	client->node = attachment->node;
	handover_swap(&client->state, attachment->state);
	handover_swap(&client->diag, attachment->diag);
	handover_swap(&client->report, attachment->report);
	handover_swap(&client->command, attachment->command);
	handover_swap(&client->wish, attachment->wish);
}

int client_attach(struct pokeys_client *client, const char *root_name, char *why, size_t size)
{
	struct attachment attachment = { 0 };
	struct iox_error error = { "" };
	char root[SHM_PATH_MAX];
	int r;

	snprintf(root, sizeof(root), "%s/%s", client->directory, root_name);
	r = check_manifest(client, root, why, size);
	if ((r == -EACCES || r == -EPERM) && runtime_is_closed(root))
		return is_being_made(root, why, size);
	if (!r)
		r = room_check(root, ATTACH_BYTES, ATTACH_FILES, why, size);
	if (r)
		return r;
	r = iox_node_open(root, client->program, &attachment.node, &error);
	if (!r)
		r = open_ports(client, &attachment, &error);
	if (r)
		explain(client, &attachment, root, r, &error, why, size);
	if (manifest_gone(root)) {
		release(&attachment);
		remove_remains(client, root_name);
		return explain(client, NULL, root, -ENOENT, &error, why, size);
	}
	if (r) {
		release(&attachment);
		return r;
	}
	hand_over(client, &attachment);
	snprintf(client->root_name, sizeof(client->root_name), "%s", root_name);
	client->news = client_news(client);
	return say(why, size, 0, "attached to device '%s' in %s", client->device, root);
}

void client_detach(struct pokeys_client *client)
{
	struct attachment attachment = {
		.node = client->node,
		.state = handover_swap(&client->state, NULL),
		.diag = handover_swap(&client->diag, NULL),
		.report = handover_swap(&client->report, NULL),
		.command = handover_swap(&client->command, NULL),
		.wish = handover_swap(&client->wish, NULL),
	};

	client->node = NULL;
	client->root_name[0] = '\0';
	release(&attachment);
}
